"""Student's distribution against scipy's own."""

import pytest
from scipy import stats

from gsfdi import student


@pytest.mark.parametrize("freedom", [1.0, 4.5, 30.0, 1e4])
@pytest.mark.parametrize("share", [0.4, 1e-3, 1e-9])
def test_it_is_scipys(share: float, freedom: float) -> None:
    value = student.limit(share, freedom)
    assert value == pytest.approx(float(stats.t.isf(share, freedom)), rel=1e-9)
    assert student.beyond(value, freedom) == pytest.approx(float(stats.t.sf(value, freedom)), rel=1e-9)
