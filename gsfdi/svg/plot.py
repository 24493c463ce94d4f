"""Curves, points, thresholds and onsets over a common axis, as one small SVG.

Colours come from CSS classes, so that a page's light, dark and print colours apply; every tone also differs in dash or
width, so that a print in grey and a colour-blind reader still tell them apart.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from hashlib import blake2s
from html import escape

import numpy as np
import numpy.typing as npt

from gsfdi.svg.marks import Instant, Level, Line, Mark, Points, Ribbon, Span
from gsfdi.svg.scale import (
    FINE,
    decades,
    decimate,
    extent,
    finite,
    path_text,
    prefixed,
    tick_labels,
    ticks,
)
from gsfdi.types import Array

WIDTH, LEFT, RIGHT, TOP, BOTTOM = 560, 62, 10, 22, 36
FAR = 1e9
"""Farthest from the drawing that anything is placed [px]."""
WIDEST = 720

CROSS = "m-14-14l28 28m0-28l-28 28"
"""What marks a point of the tone ``before``, on the fine grid; the others are dots."""


@dataclass(frozen=True, slots=True)
class Plot:
    """What to draw.

    Parameters
    ----------
    title, description : str
        Read out by a screen reader; the page prints its own caption.
    marks : tuple of marks
        Drawn in this order.
    x_label, x_unit, y_label, y_unit : str
        Axis names and SI units; prefixes (µ, m, k) and h for long times are chosen here.
    log, log_x : bool
        Whether the vertical or horizontal axis is logarithmic; what is not positive is left out.
    height : int
        In units of the drawing, which is 560 wide.
    """

    title: str
    description: str
    marks: tuple[Mark, ...]
    x_label: str = "time"
    x_unit: str = "s"
    y_label: str = ""
    y_unit: str = ""
    log: bool = False
    log_x: bool = False
    height: int = 170


@dataclass(frozen=True, slots=True)
class Axis:
    """One axis: data between `low` and `high` (after `factor`, and log10 where `log`) onto `start`..`end`."""

    low: float
    high: float
    start: float
    end: float
    factor: float
    log: bool = False

    def scaled(self, values: npt.ArrayLike) -> Array:
        """Bring data into the axis' unit."""
        array = finite(values) * self.factor
        if self.log:
            with np.errstate(divide="ignore", invalid="ignore"):
                return finite(np.log10(np.where(array > 0, array, np.nan)))
        return array

    def place(self, values: npt.ArrayLike) -> Array:
        """Bring data to where it is drawn, or as far off as may be written."""
        with np.errstate(over="ignore"):
            share = (self.scaled(values) - self.low) / (self.high - self.low)
            return np.clip(self.start + share * (self.end - self.start), -FAR, FAR)

    def ticks(self, about: int) -> tuple[Array, list[str]]:
        """Give places and labels of the ticks."""
        if self.log:
            values = decades(self.low, self.high, about) or [self.low]
            labels = [f"1e{value:.0f}".replace("-", "−") if abs(value) > 3 else f"{10**value:g}" for value in values]
        else:
            values = ticks(self.low, self.high, about)
            labels = tick_labels(values)
        places = self.start + (np.array(values) - self.low) / (self.high - self.low) * (self.end - self.start)
        return places, labels


def fit_axis(values: list[Array], unit: str, start: float, end: float, log: bool, room: float) -> tuple[Axis, str]:
    """Choose prefix and extent so that all `values` fit, with `room` (a share) beside them."""
    kept = [finite(array) for array in values]
    low, high = extent(*kept)
    factor, name = prefixed(unit, max(abs(low), abs(high)))
    axis = Axis(0.0, 1.0, start, end, factor, log)
    low, high = extent(*(axis.scaled(array) for array in kept))
    if log:
        low, high = math.floor(low * 2 - 0.2) / 2, math.ceil(high * 2 + 0.2) / 2
    spare = (high - low) * room
    return Axis(low - spare, high + spare, start, end, factor, log), name


def heights(mark: Mark) -> list[Array]:
    """Give the vertical values that a mark must be seen at."""
    if isinstance(mark, Line | Points):
        return [finite(mark.y)]
    if isinstance(mark, Ribbon):
        return [finite(mark.low), finite(mark.high)]
    return [finite([mark.y])] if isinstance(mark, Level) else []


def draw(plot: Plot, columns: int = 260) -> str:
    """Draw `plot`; a curve longer than twice `columns` keeps its extremes in each column only."""
    curves = [mark for mark in plot.marks if isinstance(mark, Line | Points | Ribbon)]
    bottom = plot.height - BOTTOM
    room = 0.02 if any(isinstance(mark, Points) for mark in curves) else 0.0
    across, x_unit = fit_axis([finite(m.x) for m in curves], plot.x_unit, LEFT, WIDTH - RIGHT, plot.log_x, room)
    tall, y_unit = fit_axis([h for m in plot.marks for h in heights(m)], plot.y_unit, bottom, TOP, plot.log, 0.06)
    body = [*frame(plot, across, tall, with_unit(plot.x_label, x_unit), with_unit(plot.y_label, y_unit))]
    for mark in plot.marks:
        body += drawn(mark, across, tall, columns)
    body += legend(curves)
    return svg(plot.title, plot.description, "".join(body), WIDTH, plot.height)


def with_unit(label: str, unit: str) -> str:
    """Write an axis name with its unit in brackets."""
    return f"{label} [{unit.replace('degC', '°C')}]" if unit and unit != "1" else label


def svg(title: str, description: str, body: str, width: float, height: float, widest: float = WIDEST) -> str:
    """Wrap a drawing so that a screen reader says what it shows; it grows with the page up to `widest` pixels."""
    key = "p" + blake2s(f"{title}{body}".encode("utf-8", "backslashreplace"), digest_size=6).hexdigest()
    return (
        f'<svg class="plot" role="img" viewBox="0 0 {width:g} {height:g}" style="max-width:{widest:.0f}px" '
        f'aria-labelledby="{key}t {key}d">'
        f'<title id="{key}t">{escape(title)}</title><desc id="{key}d">{escape(description)}</desc>{body}</svg>'
    )


def text(x: float, y: float, words: str, classes: str = "", extra: str = "") -> str:
    """Write `words` at a place."""
    name = f' class="{classes}"' if classes else ""
    return f'<text x="{x:.0f}" y="{y:.0f}"{name}{extra}>{escape(words)}</text>'


def frame(plot: Plot, across: Axis, tall: Axis, x_name: str, y_name: str) -> Iterator[str]:
    """Draw grid lines, tick labels and axis names."""
    bottom = plot.height - BOTTOM
    places, labels = tall.ticks(max(3, round((bottom - TOP) / 30)))
    yield '<path class="grid" d="' + "".join(f"M{LEFT} {y:.1f}H{WIDTH - RIGHT}" for y in places) + '"/>'
    yield "".join(text(LEFT - 5, y + 4, name, "e") for y, name in zip(places, labels, strict=True))
    places, labels = across.ticks(8)
    yield '<path class="grid" d="' + "".join(f"M{x:.1f} {TOP}V{bottom}" for x in places) + '"/>'
    yield "".join(text(x, bottom + 14, name, "m") for x, name in zip(places, labels, strict=True))
    yield text((LEFT + WIDTH - RIGHT) / 2, plot.height - 5, x_name, "m")
    middle = (TOP + bottom) / 2
    yield text(12, middle, y_name, "m", f' transform="rotate(-90 12 {middle:.0f})"')


def drawn(mark: Mark, across: Axis, tall: Axis, columns: int) -> Iterator[str]:
    """Draw one mark."""
    if isinstance(mark, Line):
        x, y = decimate(finite(mark.x), finite(mark.y), columns)
        yield curve(path_text(across.place(x), tall.place(y)), f"ln {mark.tone}")
    elif isinstance(mark, Points):
        x, y = across.place(mark.x), tall.place(mark.y)
        seen = np.unique(np.rint(np.column_stack((x, y))[np.isfinite(x) & np.isfinite(y)]), axis=0)
        sign = CROSS if mark.tone == "before" else "h0"
        yield curve("".join(f"M{a * FINE:.0f} {b * FINE:.0f}{sign}" for a, b in seen.tolist()), f"pt {mark.tone}")
    elif isinstance(mark, Ribbon):
        x, low = decimate(finite(mark.x), finite(mark.low), columns)
        again, high = decimate(finite(mark.x), finite(mark.high), columns)
        x, y = np.append(x, again[::-1]), np.append(low, high[::-1])
        good = np.isfinite(y)
        yield curve(path_text(across.place(x[good]), tall.place(y[good])) + "z", f"rb {mark.tone}")
    else:
        yield from drawn_note(mark, across, tall)


def drawn_note(mark: Span | Level | Instant, across: Axis, tall: Axis) -> Iterator[str]:
    """Draw a threshold, an onset or a shaded stretch, with its name beside it."""
    if isinstance(mark, Level):
        (y,) = tall.place([mark.y])
        if math.isfinite(y):
            yield f'<path class="level" d="M{LEFT} {y:.1f}H{WIDTH - RIGHT}"/>'
            yield text(WIDTH - RIGHT - 4, y - 4 if y > TOP + 14 else y + 13, mark.label, "e note")
        return
    ends = [mark.x] if isinstance(mark, Instant) else [mark.start, mark.end]
    meant = across.place(ends)
    places = np.clip(meant, LEFT, WIDTH - RIGHT)
    outside = isinstance(mark, Instant) and abs(places[0] - meant[0]) > 1
    if outside or not np.isfinite(places).all():
        return
    if isinstance(mark, Span):
        width = places[1] - places[0]
        yield f'<rect class="span" x="{places[0]:.1f}" y="{TOP}" width="{width:.1f}" height="{tall.start - TOP:.0f}"/>'
    else:
        yield f'<path class="instant" d="M{places[0]:.1f} {TOP}V{tall.start:.0f}"/>'
    late = places[0] > 0.75 * WIDTH
    yield text(places[0] + (-4 if late else 4), TOP + 11, mark.label, "e note" if late else "note")


def curve(data: str, classes: str) -> str:
    """Place a path that is written on the fine grid."""
    return f'<path class="{classes}" transform="scale({1 / FINE:g})" d="{data}"/>' if data else ""


def legend(curves: list[Line | Points | Ribbon]) -> Iterator[str]:
    """Name the curves in one row above the frame."""
    x = float(LEFT)
    for mark in curves:
        if not mark.label:
            continue
        kind = {Line: "ln", Points: "pt", Ribbon: "rb"}[type(mark)]
        swatch = f"M{x:.0f} 4h18v8h-18z" if kind == "rb" else f"M{x:.0f} 8h18" if kind == "ln" else ""
        if kind == "pt":
            yield curve(
                f"M{(x + 9) * FINE:.0f} {8 * FINE}{CROSS if mark.tone == 'before' else 'h0'}", f"pt {mark.tone}"
            )
        else:
            yield f'<path class="{kind} {mark.tone}" d="{swatch}"/>'
        yield text(x + 23, 12, mark.label)
        x += 23 + 6.3 * len(mark.label) + 18
