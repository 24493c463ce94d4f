import numpy as np
import pytest

from gsfdi.types import JointRecord, frozen


def recorded(values: np.ndarray, **valid: np.ndarray) -> JointRecord:
    return JointRecord("r", "j", 0, 0.01 * np.arange(len(values)), {"position": values}, valid=valid)


def test_what_could_be_written_to_is_copied() -> None:
    values = np.arange(5.0)
    view = values[:4]
    view.setflags(write=False)
    for given in (values, view):
        record = recorded(given)
        kept = record.channels["position"].copy()
        values[0] += 7.0
        assert np.array_equal(record.channels["position"], kept)
        with pytest.raises(ValueError, match="read-only"):
            record.channels["position"][0] = 1.0


def test_what_nobody_can_write_to_is_not_copied() -> None:
    values = frozen(np.arange(5.0))
    assert recorded(values).channels["position"] is values
    assert np.shares_memory(recorded(values[1:4]).channels["position"], values)


def test_whole_numbers_become_float64() -> None:
    assert recorded(np.arange(5)).channels["position"].dtype == np.float64


def test_a_channel_is_read_where_it_may_be_believed() -> None:
    values = frozen([1.0, 2.0, 3.0])
    assert recorded(values, position=np.array([True, True, True]))["position"] is values
    told = recorded(values, position=np.array([True, False, True]))["position"]
    assert np.array_equal(told, [1.0, np.nan, 3.0], equal_nan=True)
    assert not told.flags.writeable
