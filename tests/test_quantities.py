"""Every published name of a channel or a parameter is read back with the unit that it was published with."""

import pytest

from gsfdi.channels import CHANNELS
from gsfdi.modelfile import terms
from gsfdi.reports.quantities import quantity

COLUMNS = [
    pair
    for channel in CHANNELS.values()
    for pair in ((channel.rotary, channel.rotary_unit), (channel.linear, channel.linear_unit))
]
PARAMETERS = sorted({(param.name, param.unit) for term in terms().values() for param in term.params})
SAME = {"degC": "°C", "1/K": "", "1/rev": "", "1": ""}
"""A page says °C, and leaves out what the name itself says or what is no unit."""


@pytest.mark.parametrize(("name", "unit"), COLUMNS + PARAMETERS)
def test_a_name_keeps_its_unit(name: str, unit: str) -> None:
    words, read = quantity(name)
    assert read == SAME.get(unit, unit)
    assert words
    assert "_" not in words
