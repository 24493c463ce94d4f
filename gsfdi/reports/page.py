"""What all pages share: one self-contained file each, nothing fetched, everything escaped that came from a file."""

import hashlib
import math
from base64 import b64encode
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache

import jinja2
from markupsafe import Markup

from gsfdi.reports import storable
from gsfdi.svg import PLOT_STYLE, Plot, draw


@dataclass(frozen=True, slots=True)
class Figure:
    """A drawing with the caption that says what to see in it."""

    caption: str
    svg: Markup


def plotted(plot: Plot, columns: int = 260) -> Figure:
    """Draw `plot` for a page, under its description."""
    return Figure(plot.description, Markup(draw(plot, columns)))


@cache
def environment() -> jinja2.Environment:
    """Load the templates: autoescaped, and failing on a name they do not know rather than printing nothing."""
    templates = jinja2.Environment(
        loader=jinja2.PackageLoader("gsfdi.reports", "templates"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    templates.filters.update(
        words=words, number=number, percent=percent, likely=likely, chance=chance, sentence=finished
    )
    return templates


def render(template: str, values: Mapping[str, object]) -> str:
    """Fill a template; its script is allowed by its hash and no other can run, whatever a name smuggles in."""
    script = str(environment().get_template("page.js").render())
    allowed = "sha256-" + b64encode(hashlib.sha256(script.encode()).digest()).decode()
    page = environment().get_template(template)
    text = page.render(values, plot_style=Markup(PLOT_STYLE), script=Markup(script), script_hash=allowed)
    return storable(text)


def words(name: object) -> str:
    """Write an id as words.

    Examples
    --------
    >>> words("torque_constant_drift")
    'torque constant drift'
    """
    return str(name).replace("_", " ")


def number(value: float | None, digits: int = 3) -> str:
    """Write a number briefly, a missing one as a dash.

    Examples
    --------
    >>> number(0.000213), number(None), number(float("nan")), number(12345.6)
    ('2.13e−4', '–', '–', '12,346')
    """
    if value is None or math.isnan(value):
        return "–"
    if math.isinf(value):
        return "∞" if value > 0 else "−∞"
    size = abs(value)
    if 1e4 <= size < 1e7:
        return f"{value:,.0f}"
    if size and not 1e-3 <= size < 1e7:
        mantissa, exponent = f"{value:.{digits - 1}e}".split("e")
        mantissa = mantissa.rstrip("0").rstrip(".") if digits > 3 else mantissa
        return f"{mantissa}e{int(exponent)}".replace("-", "−")
    return f"{value:.{digits}g}".replace("-", "−") if size < 1000 else f"{value:.0f}".replace("-", "−")


def percent(share: float | None) -> str:
    """Write a share in percent.

    Examples
    --------
    >>> percent(0.973), percent(0.9996), percent(0.0004), percent(None)
    ('97 %', '> 99.9 %', '< 0.1 %', '–')
    """
    if share is None or math.isnan(share):
        return "–"
    if 0.999 < share < 1:
        return "> 99.9 %"
    if 0 < share < 0.001:
        return "< 0.1 %"
    if share < 0.1:
        return f"{100 * share:.2g} %".replace("-", "−")
    return f"{100 * share:.1f} %" if 0.9949 < share < 1 else f"{100 * share:.0f} %"


def likely(probability: float | None) -> str:
    """Write a probability in percent; nothing that was inferred is certain.

    Examples
    --------
    >>> likely(1.0), likely(0.97), likely(0.0)
    ('> 99.9 %', '97 %', '< 0.1 %')
    """
    return percent(probability if probability is None else min(max(probability, 1e-9), 1 - 1e-9))


def chance(p_value: float | None) -> str:
    """Write a p-value; what is smaller than any table is only called so.

    Examples
    --------
    >>> chance(0.4), chance(1e-12), chance(0.0)
    ('0.4', '1e−12', '< 1e−300')
    """
    if p_value is None or math.isnan(p_value):
        return "–"
    if p_value <= 1e-300:
        return "< 1e−300"
    return f"{p_value:.2g}" if p_value >= 0.001 else f"{p_value:.0e}".replace("e-0", "e-").replace("-", "−")


def finished(text: str) -> str:
    """Begin with a capital and end with a stop.

    Examples
    --------
    >>> finished("the residual of SH1 stays low")
    'The residual of SH1 stays low.'
    """
    return text[:1].upper() + text[1:] + ("" if text.endswith((".", "!", "?")) else ".")
