from pathlib import Path

import numpy as np
import pytest

from gsfdi.errors import UnusableInputError
from gsfdi.mapping import load_mapping, parse

HEAD = {"schema": "gsfdi/mapping/1", "robot": "arm"}


@pytest.mark.parametrize(
    ("column", "unit", "si"),
    [
        ("position_rad", "deg", np.pi / 180),
        ("motor_velocity_rad_s", "rpm", np.pi / 30),
        ("position_m", "mm", 1e-3),
        ("motor_current_a", "mA", 1e-3),
        ("drive_force_n", "kN", 1e3),
    ],
)
def test_units_become_si(column: str, unit: str, si: float) -> None:
    mapping = parse({**HEAD, column: {"columns": {"J1": 1}, "unit": unit, "scale": 2.0}})
    (source,) = mapping.sources.values()
    assert source.factor == pytest.approx(2 * si)


def test_kelvin_becomes_celsius() -> None:
    source = parse({**HEAD, "temperature_c": {"columns": {"J1": 1}, "unit": "K"}}).sources["temperature"]
    assert source.factor * 300.0 + source.offset == pytest.approx(26.85)


@pytest.mark.parametrize(
    ("extra", "named"),
    [
        ({"positon_rad": {"columns": {"J1": 1}}}, "position_rad"),
        ({"position_rad": {"columns": {"J1": 1}, "unit": "degree"}}, "deg"),
        ({"position_rad": {"unit": "deg"}}, "columns"),
        ({"position_rad": {"colums": {"J1": 1}}}, "columns"),
        ({"position_rad": {"columns": {"J1": 1}}, "position_m": {"columns": {"J2": 2}}}, "rotary and linear"),
        ({"position_rad": {"columns": {"J1": 1}}, "time_unit": "h"}, "ms"),
        ({"position_rad": {"columns": {"J1": 1}}, "time_epoch": "yesterday"}, "2026-11-21"),
        ({}, "no column"),
        ({"schema": "gsfdi/model/1"}, "gsfdi/mapping/1"),
    ],
)
def test_complaints_say_what_would_mend(extra: dict[str, object], named: str) -> None:
    with pytest.raises(UnusableInputError, match=named):
        parse({**HEAD, **extra})


def test_epoch_is_a_date_or_seconds() -> None:
    table = {"position_rad": {"columns": {"J1": 1}}}
    assert parse({**HEAD, **table, "time_epoch": "2026-11-21T00:00:00Z"}).epoch_ns == 1_795_219_200 * 10**9
    assert parse({**HEAD, **table, "time_epoch": 5}).epoch_ns == 5 * 10**9


def test_epoch_may_stand_in_the_files_name() -> None:
    table = {"position_rad": {"columns": {"J1": 1}}}
    mapping = parse({**HEAD, **table, "time_epoch_name": "%Y-%m-%d_%H%M%S"})
    assert mapping.epoch_of("x/run 2026-11-21_000001 a.csv") == 1_795_219_201 * 10**9
    for name in ("run.csv", "run 2026-13-41_000001.csv"):
        with pytest.raises(UnusableInputError, match="no date"):
            mapping.epoch_of(name)


@pytest.mark.parametrize("path", sorted((Path(__file__).parents[1] / "configs").glob("*.toml")), ids=lambda p: p.stem)
def test_mappings_shipped_are_read(path: Path) -> None:
    if "gsfdi/mapping/1" in path.read_text():
        assert load_mapping(path).sources


def test_what_is_no_toml_is_named(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text("robot = ")
    with pytest.raises(UnusableInputError, match=r"m\.toml"):
        load_mapping(path)
    with pytest.raises(UnusableInputError, match="cannot be read"):
        load_mapping(tmp_path / "none.toml")
