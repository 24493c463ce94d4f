"""Reads a fault as the command line spells it."""

from gsfdi.channels import Axis
from gsfdi.errors import UnusableInputError, nearest
from gsfdi.model import TermUse
from gsfdi.motion import linear_name
from gsfdi.packed import term_of


def fault_of(text: str, axis: Axis = "rotary") -> TermUse:
    """Read ``ID=VALUE[,NAME=VALUE...][@SECONDS]``; VALUE sets the term's first parameter, ``side=motor`` its side.

    Examples
    --------
    >>> fault_of("cogging=2.5,order=24@30")
    TermUse(term='cogging', values={'amplitude_nm': 2.5, 'order': 24.0}, side=None, onset=30.0)
    """
    body, _, onset = text.partition("@")
    first, *others = body.split(",")
    name, _, value = first.partition("=")
    term = term_of(TermUse(name.strip()))
    values, side = {term.params[0].name: _number(text, value)}, None
    for other in others:
        key, _, value = (part.strip() for part in other.partition("="))
        if key == "side" and value in term.sides:
            side = value
            continue
        known = {p.name if axis == "rotary" else linear_name(p.name): p for p in term.params}
        if key not in known:
            raise UnusableInputError(f"fault {text!r}", f"{name} has no {key!r}", nearest(key, [*known, "side"]))
        values[known[key].name] = _number(text, value)
    for key, number in values.items():
        param = term.param(key)
        if not param.low <= number <= param.high:
            what = f"{key} = {number:g} is impossible"
            raise UnusableInputError(f"fault {text!r}", what, f"give {param.low:g} to {param.high:g} {param.unit}")
    return TermUse(term.name, values, side, _number(text, onset) if onset else None)


def _number(text: str, value: str) -> float:
    """Read a number of a fault, or say what is wrong with it."""
    try:
        return float(value)
    except ValueError:
        what = f"{value!r} is not a number"
        raise UnusableInputError(f"fault {text!r}", what, "write ID=VALUE or ID=VALUE@SECONDS") from None
