"""Bars that rank, matrices that count, and maps over two axes."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gsfdi.svg.marks import Tone
from gsfdi.svg.plot import svg, text
from gsfdi.svg.scale import tick_labels, ticks
from gsfdi.types import Array, Mask

LETTER = 7.0
"""Width of an average letter of the drawings' type, in units of the drawing."""


@dataclass(frozen=True, slots=True)
class Bar:
    """One row of a ranking: its name, its length, an optional interval, and a word behind it."""

    label: str
    value: float
    low: float | None = None
    high: float | None = None
    tone: Tone = "measured"
    note: str = ""


def draw_bars(title: str, description: str, bars: Sequence[Bar], limit: float = 0.0, width: int = 560) -> str:
    """Draw a ranking as horizontal bars from zero; `limit` is where the axis ends at least."""
    shown = [bar for bar in bars if np.isfinite(bar.value)]
    left = min(330.0, 12 + LETTER * max((len(bar.label) for bar in shown), default=4))
    top = max([limit, *(max(bar.value, bar.high or 0.0) for bar in shown)]) or 1.0
    right = 12 + LETTER * max((len(bar.note or f"{bar.value:.3g}") for bar in shown), default=0)
    scale = (width - left - right) / top
    bottom = 8 + 22 * len(shown)
    values = ticks(0.0, top)
    marks = zip(values, tick_labels(values), strict=True)
    body = ['<path class="grid" d="' + "".join(f"M{left + v * scale:.1f} 4V{bottom}" for v in values) + '"/>']
    body += [text(left + value * scale, bottom + 14, name, "m") for value, name in marks]
    for row, bar in enumerate(shown):
        y = 6 + 22 * row
        body.append(text(left - 6, y + 13, bar.label, "e"))
        length = max(bar.value, 0.0) * scale
        body.append(f'<rect class="bar {bar.tone}" x="{left:.1f}" y="{y}" width="{length:.1f}" height="16"/>')
        end = left + length
        if bar.low is not None and bar.high is not None:
            x0, x1 = left + bar.low * scale, left + bar.high * scale
            body.append(f'<path class="whisker" d="M{x0:.1f} {y + 8}H{x1:.1f}M{x0:.1f} {y + 4}v8M{x1:.1f} {y + 4}v8"/>')
            end = max(end, x1)
        body.append(text(end + 6, y + 13, bar.note or f"{bar.value:.3g}"))
    return svg(title, description, "".join(body), width, bottom + 20)


def draw_matrix(
    title: str, description: str, rows: Sequence[str], columns: Sequence[str], counts: Array, right: Mask
) -> str:
    """Draw counts of what was (rows) against what was said (columns): the shade is the share of a row, blue right."""
    cell = 24 if len(columns) <= 18 else 17
    left = 10 + LETTER * max(map(len, rows), default=0)
    top = 10 + LETTER * 0.75 * max(map(len, columns), default=0)
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    body = []
    for i, name in enumerate(rows):
        y = top + i * cell
        body.append(text(left - 6, y + cell * 0.68, name, "e"))
        for j in np.flatnonzero(counts[i]).tolist():
            x, kind = left + j * cell, "hit" if right[i, j] else "miss"
            strong = 0.15 + 0.85 * float(share[i, j])
            body.append(
                f'<rect class="{kind}" x="{x:.0f}" y="{y:.0f}" width="{cell - 1}" height="{cell - 1}" '
                f'fill-opacity="{strong:.2f}"/>'
            )
            inked = "m onfill" if strong > 0.55 else "m"
            body.append(text(x + cell / 2 - 0.5, y + cell * 0.68, f"{counts[i, j]:g}", inked))
    for j, name in enumerate(columns):
        x = left + j * cell + cell * 0.65
        body.append(text(x, top - 6, name, "", f' transform="rotate(-50 {x:.0f} {top - 6:.0f})"'))
    width = left + cell * len(columns) + 0.65 * LETTER * max(map(len, columns), default=0)
    height = top + cell * len(rows) + 4
    grid = "".join(f"M{left:.0f} {top + i * cell - 0.5:.1f}h{cell * len(columns)}" for i in range(len(rows) + 1))
    return svg(title, description, f'<path class="grid" d="{grid}"/>' + "".join(body), width, height, 1.2 * width)


def draw_map(
    title: str,
    description: str,
    values: Array,
    x_label: str,
    y_label: str,
    x_ends: tuple[float, float],
    y_ends: tuple[float, float],
    largest: float | None = None,
) -> str:
    """Draw an (ny, nx) array as cells; blue above zero, orange below, paler towards zero, NaN left blank.

    `largest` is the value of full colour, so that two maps can share a scale.
    """
    rows, columns = values.shape
    full = largest or float(np.nanmax(np.abs(values), initial=0.0)) or 1.0
    left, top, width, height = 62, 8, 200, 130
    across = np.rint(left + np.arange(columns + 1) * width / columns).astype(int).tolist()
    down = np.rint(top + height - np.arange(rows + 1) * height / rows).astype(int).tolist()
    body = []
    for i in range(rows):
        for j in np.flatnonzero(np.isfinite(values[i])).tolist():
            strong = min(1.0, abs(float(values[i, j])) / full)
            if strong >= 0.03:
                body.append(
                    f'<rect class="{"up" if values[i, j] > 0 else "down"}" x="{across[j]}" y="{down[i + 1]}" '
                    f'width="{across[j + 1] - across[j]}" height="{down[i] - down[i + 1]}" '
                    f'fill-opacity="{strong:.2f}"/>'
                )
    body.append(f'<rect class="frame" x="{left}" y="{top}" width="{width}" height="{height}"/>')
    for value, name in zip(ticks(*x_ends, 4), tick_labels(ticks(*x_ends, 4)), strict=True):
        body.append(text(left + (value - x_ends[0]) / (x_ends[1] - x_ends[0]) * width, top + height + 14, name, "m"))
    for value, name in zip(ticks(*y_ends, 4), tick_labels(ticks(*y_ends, 4)), strict=True):
        share = (value - y_ends[0]) / (y_ends[1] - y_ends[0])
        body.append(text(left - 5, top + (1 - share) * height + 4, name, "e"))
    middle = top + height / 2
    body.append(text(left + width / 2, top + height + 29, x_label, "m"))
    body.append(text(12, middle, y_label, "m", f' transform="rotate(-90 12 {middle:.0f})"'))
    return svg(title, description, "".join(body), left + width + 18, top + height + 34)
