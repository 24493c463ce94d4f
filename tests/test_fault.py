import pytest

from gsfdi.errors import UnusableInputError
from gsfdi.fault import fault_of
from gsfdi.model import TermUse


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("stribek_friction=1", "did you mean 'stribeck_friction'"),
        ("cogging", "'' is not a number"),
        ("cogging=much", "'much' is not a number"),
        ("cogging=1@soon", "'soon' is not a number"),
        ("cogging=1,ordre=3", "did you mean 'order'"),
        ("cogging=-1", "-1 is impossible"),
        ("coulomb_friction=1,side=engine", "has no 'side'"),
    ],
)
def test_faults_that_are_no_faults(text: str, says: str) -> None:
    with pytest.raises(UnusableInputError, match=says):
        fault_of(text)


def test_faults_of_a_linear_drive() -> None:
    use = fault_of("coulomb_friction=20,side=output@3", "linear")
    assert use == TermUse("coulomb_friction", {"torque_nm": 20.0}, "output", 3.0)
    assert fault_of("cogging=2,phase_rad=1", "linear").values == {"amplitude_nm": 2.0, "phase_rad": 1.0}
