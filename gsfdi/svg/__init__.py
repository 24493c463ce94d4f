"""Small SVG plots, written as text: they follow the reader's light or dark colours, and print.

Why not matplotlib: 35 plots of 6,000 samples took it 1.2 s beyond 0.3 s for its import, and 113 kB each, where these
take 0.04 s and 4 kB each (``benchmarks/drawing.py``); a whole analysis has 3 s.
"""

from gsfdi.svg.charts import Bar, draw_bars, draw_map, draw_matrix
from gsfdi.svg.marks import Instant, Level, Line, Mark, Points, Ribbon, Span, Tone
from gsfdi.svg.plot import Plot, draw
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
