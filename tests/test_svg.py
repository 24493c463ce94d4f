"""Drawings are small, well-formed, true to the extremes of what they draw, and never trip over odd numbers."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from gsfdi.svg import Bar, Instant, Level, Line, Plot, Points, Ribbon, Span, draw, draw_bars, draw_map, draw_matrix
from gsfdi.svg.scale import FINE, decimate, path_text, tick_labels, ticks

ANY = hnp.arrays(np.float64, st.integers(0, 60), elements=st.floats(allow_nan=True, allow_infinity=True))


def places(path: str) -> npt.NDArray[np.float64]:
    """Walk a path of ``M x y l dx dy ...`` and give every place it visits."""
    visited = []
    for command, numbers in re.findall(r"([Mlh])([-\d ]*)", path):
        values = [int(number) for number in re.findall(r"-?\d+", numbers)]
        if command == "M":
            visited.append((values[0], values[1]))
        elif command == "l":
            for dx, dy in zip(values[::2], values[1::2], strict=True):
                visited.append((visited[-1][0] + dx, visited[-1][1] + dy))
    return np.array(visited) / FINE


def test_a_single_spike_in_a_million_samples_is_drawn() -> None:
    t = np.arange(1_000_000) * 1e-3
    y = np.zeros(t.size)
    y[734_211] = 1.0
    drawing = draw(Plot("spike", "one spike", (Line(t, y, "signal"),)))
    assert len(drawing) < 4000
    curve = next(path.get("d") for path in ET.fromstring(drawing).iter() if path.get("class") == "ln measured")
    tops = places(str(curve))[:, 1]
    assert tops.max() - tops.min() > 90


def test_noise_costs_bytes_by_the_column_not_by_the_sample() -> None:
    noise = np.random.default_rng(1).normal(size=(2, 100_000))
    sizes = [len(draw(Plot("n", "noise", (Line(np.arange(n), noise[0, :n], "n"),)))) for n in (10_000, 100_000)]
    assert max(sizes) < 8000


@given(hnp.arrays(np.float64, st.integers(2, 400), elements=st.floats(-1e6, 1e6)), st.integers(1, 40))
@settings(max_examples=60, deadline=None)
def test_decimation_keeps_the_extremes(y: npt.NDArray[np.float64], columns: int) -> None:
    x = np.cumsum(np.abs(np.sin(np.arange(y.size))) + 0.01)
    thin_x, thin_y = decimate(x, y, columns)
    assert thin_y.min() == y.min()
    assert thin_y.max() == y.max()
    assert thin_x.size <= max(2 * columns, y.size if y.size <= 2 * columns else 0)
    assert (np.diff(thin_x) >= 0).all()


@given(hnp.arrays(np.float64, st.integers(2, 80), elements=st.floats(0, 300)))
@settings(max_examples=60, deadline=None)
def test_a_path_stays_within_a_pixel_of_its_samples(y: npt.NDArray[np.float64]) -> None:
    x = np.arange(y.size) * 3.0
    walked = places(path_text(x, y))
    starts, legs = walked[:-1], np.diff(walked, axis=0)
    for place in np.column_stack((x, y)):
        along = ((place - starts) * legs).sum(axis=1) / np.maximum((legs**2).sum(axis=1), 1e-12)
        nearest = starts + np.clip(along, 0, 1)[:, None] * legs
        assert np.hypot(*(place - nearest).T).min() < 1.0


@given(ANY, ANY, st.booleans())
@example(np.array([8.83164639e-292]), np.array([3.38353559e13]), False)
@settings(max_examples=80, deadline=None)
def test_any_numbers_give_a_well_formed_drawing(
    x: npt.NDArray[np.float64], y: npt.NDArray[np.float64], log: bool
) -> None:
    n = min(x.size, y.size)
    x, y = x[:n], y[:n]
    level = float(y[0]) if n else float("nan")
    marks = (
        Line(x, y, "line"),
        Points(x, y, "points"),
        Ribbon(x, y, y, "ribbon"),
        Level(level, "level"),
        Instant(level, "instant"),
        Span(level, level, "span"),
    )
    drawing = draw(Plot("t", "d", marks, y_unit="rad", log=log))
    ET.fromstring(drawing)
    assert not re.search(r"\b(nan|inf)\b", drawing)


@pytest.mark.parametrize("value", [0.0, 5.0, -1e-9, 3e8])
def test_a_constant_is_drawn_in_the_middle_of_its_axis(value: float) -> None:
    drawing = draw(Plot("t", "d", (Line([0, 1, 2], [value] * 3, "flat"),)))
    ET.fromstring(drawing)
    assert "NaN" not in drawing


@given(st.floats(-1e6, 1e6), st.floats(1e-9, 1e6))
@settings(max_examples=80, deadline=None)
def test_ticks_are_few_and_lie_inside_and_read_differently(low: float, span: float) -> None:
    high = low + span
    if high - low < 1e-7 * max(abs(low), abs(high)):
        return
    values = ticks(low, high)
    assert 2 <= len(values) <= 11
    assert all(low - 0.01 * span <= value <= high + 0.01 * span for value in values)
    if max(map(abs, values)) < 1e6:
        assert len(set(tick_labels(values))) == len(values)


def test_an_instant_outside_the_axis_is_not_drawn_at_its_edge() -> None:
    curve = Line([20.0, 30.0], [0.0, 1.0], "angle")
    inside, outside = (draw(Plot("t", "d", (curve, Instant(x, "onset")))) for x in (25.0, 10.0))
    assert "onset" in inside
    assert "onset" not in outside


def test_texts_are_escaped_everywhere() -> None:
    evil = "<b>&\"'"
    drawings = [
        draw(Plot(evil, evil, (Line([0, 1], [0, 1], evil), Level(0.5, evil), Instant(0.5, evil)), evil, "s", evil)),
        draw_bars(evil, evil, [Bar(evil, 1.0, 0.5, 1.5, note=evil)]),
        draw_matrix(evil, evil, [evil], [evil], np.eye(1), np.eye(1) > 0),
        draw_map(evil, evil, np.eye(3), evil, evil, (0, 1), (0, 1)),
    ]
    for drawing in drawings:
        assert "<b>" not in drawing
        assert evil in "".join(ET.fromstring(drawing).itertext())


def test_bars_and_whiskers_stay_inside_the_drawing() -> None:
    bars = [Bar("one", 1.0, 0.2, 9.0), Bar("none", 0.0), Bar("missing", float("nan"))]
    root = ET.fromstring(draw_bars("t", "d", bars))
    width = float(root.get("viewBox", "").split()[2])
    ends = [float(rect.get("x", 0)) + float(rect.get("width", 0)) for rect in root.iter("rect")]
    assert len(ends) == 2
    assert max(ends) <= width
    assert max(float(end) for end in re.findall(r"H([\d.]+)M", ET.tostring(root).decode())) <= width


def test_a_matrix_shows_every_count_once() -> None:
    counts = np.array([[8, 0, 1], [0, 7, 0]])
    root = ET.fromstring(draw_matrix("t", "d", ["a", "b"], ["a", "b", "c"], counts, np.eye(2, 3) > 0))
    cells = [rect.get("class") for rect in root.iter("rect")]
    assert sorted(map(str, cells)) == ["hit", "hit", "miss"]


def test_a_map_leaves_blank_what_is_not_known() -> None:
    values = np.full((4, 6), np.nan)
    values[1, 2], values[3, 0] = 2.0, -2.0
    root = ET.fromstring(draw_map("t", "d", values, "x", "y", (0, 1), (0, 1)))
    assert [rect.get("class") for rect in root.iter("rect")] == ["up", "down", "frame"]
