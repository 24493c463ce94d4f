"""Small SVG plots, written as text: they follow the reader's light or dark colours, and print."""

from gsfdi.svg.charts import Bar, draw_bars, draw_map, draw_matrix
from gsfdi.svg.plot import Instant, Level, Line, Mark, Plot, Points, Ribbon, Span, Tone, draw
from gsfdi.svg.style import PLOT_STYLE

__all__ = [
    "PLOT_STYLE",
    "Bar",
    "Instant",
    "Level",
    "Line",
    "Mark",
    "Plot",
    "Points",
    "Ribbon",
    "Span",
    "Tone",
    "draw",
    "draw_bars",
    "draw_map",
    "draw_matrix",
]
