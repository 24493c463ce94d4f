"""What a verdict says: sentences for people, and the experiments that would settle what the data cannot."""

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

from gsfdi.model import TermUse
from gsfdi.motion import PhysicsTerm, linear_name
from gsfdi.reconcile.reconciliation import Outcome

CONFUSED: Mapping[frozenset[str], str] = {
    frozenset(
        {"constant_load", "asymmetric_friction"}
    ): "hold the joint still at several angles: a load must be carried at rest, a friction need not be",
    frozenset(
        {"coulomb_friction", "constant_load"}
    ): "move both ways, and at several speeds: a friction turns round with the motion, a load does not",
    frozenset(
        {"cogging", "torque_ripple"}
    ): "repeat the motion under another load: a ripple grows with the current, a cogging does not",
    frozenset(
        {"constant_load", "current_bias"}
    ): "read the current with the drive switched off: what remains is the sensor's",
    frozenset({"asymmetric_friction", "current_bias"}): "read the current with the drive switched off",
    frozenset({"torque_constant_change", "current_gain"}): "compare the current with an independent meter",
    frozenset({"torque_constant_change", "output_inertia_change"}): "move once with a known extra inertia or load",
    frozenset(
        {"gravity_unbalance", "cable_harness"}
    ): "move over a wider range: a weight's torque turns over, a cable's does not",
    frozenset(
        {"gravity_unbalance", "constant_load"}
    ): "move over a wider range: a weight's torque turns over, a constant one stays",
    frozenset({"position_gain", "velocity_gain"}): "turn the joint between two stops of known distance",
    frozenset(
        {"actuation_delay", "timestamp_latency"}
    ): "log the controller's own input: its law must hold without a delay",
    frozenset({"coulomb_friction", "presliding_friction"}): "make moves of less than the break-away distance at rest",
    frozenset({"stribeck_friction", "presliding_friction"}): "creep at several constant slow speeds",
    frozenset({"gearbox_hysteresis", "backlash"}): "lock the output and load the gearbox slowly both ways",
    frozenset({"viscous_friction", "temperature_dependent_friction"}): "repeat the motion at another temperature",
}
"""Terms that look alike, and the experiment that tells them apart."""


def experiment(names: Sequence[str]) -> str:
    """Name the experiment that would separate `names`, or the general one where none is known."""
    for pair, text in CONFUSED.items():
        if pair <= set(names):
            return text
    return "excite the joint more widely: faster, slower, over its whole range and with reversals"


def summary(verdict: Outcome, entries: Sequence[Mapping[str, Any]], left: float, of: str = "missing torque") -> str:
    """One sentence for a person, where `left` of what `of` names remains."""
    counts = Counter(str(e["term"]).replace("_", " ") for e in entries)
    named = ", ".join(name if count == 1 else f"{name} ({count} times)" for name, count in counts.items())
    if verdict == "no_mismatch":
        return "Simulation and recording agree to within noise and the tolerance of the model's numbers."
    if verdict == "not_enough_data":
        return "The recordings hardly move the joint: not even its inertia shows in them, and nothing else would."
    if verdict == "unexplained" and not entries:
        return "Simulation and recording differ, and nothing in the library accounts for it; the location still stands."
    if verdict == "explained":
        return f"The mismatch is explained by {named}."
    verb = "accounts" if len(entries) == 1 else "account"
    return f"{named} {verb} for part of the mismatch; {100 * left:.0f} % of the {of} remains unexplained."


def spelled(name: str, axis: str) -> str:
    """Name a parameter as the joint's axis spells it."""
    return name if axis == "rotary" else linear_name(name)


def rewritten(nominal: Sequence[TermUse], found: Sequence[TermUse], axis: str) -> str:
    """Say which numbers the nominal model's own terms have that it did not give them; nothing where there are none."""
    told = [
        f"{old.term.replace('_', ' ')} with {spelled(name, axis)} = {value:.4g}"
        for old, new in zip(nominal, found, strict=False)
        for name, value in new.values.items()
        if name not in old.values
    ]
    return f" Of the model's own terms that takes {', '.join(told)}." if told else ""


def bent(terms: Sequence[str]) -> str:
    """Say which numbers of the plant went as far as they are believed; nothing where none did."""
    if not terms:
        return ""
    numbers = ", ".join(term.removesuffix("_change").replace("_", " ") for term in terms)
    return f" The model's {numbers} went as far as they are believed: another law may be at work, or they are worse."


def varying(found: Sequence[tuple[str, str]]) -> str:
    """Say which sizes are no constants; nothing where all are."""
    told = "; ".join(f"that of the {term.replace('_', ' ')} is another {where}" for term, where in found)
    return f" A size should be one number: {told}. Something that is not in the library may be at work." if told else ""


def timed(shift: float) -> str:
    """Say how the log is shifted within a tick; nothing where it is not."""
    if shift == 0.0:
        return ""
    told = f"{1e3 * abs(shift):.2g} ms {'before' if shift > 0 else 'after'} their stamps"
    return f" How the log was made, and no fault: efforts act {told}, speeds are those of then."


def sentence(
    use: TermUse, term: PhysicsTerm | None, gain_share: float, axis: str, rivals: Sequence[str], either: bool = False
) -> str:
    """Say what a term means here, for a person; `either` where it may as well sit on the other side."""
    meaning = term.meaning if term is not None else "the controller's gain is not the one in the model"
    numbers = ", ".join(f"{spelled(name, axis)} = {value:.4g}" for name, value in use.values.items())
    text = f"{meaning} ({numbers})"
    if term is not None and len(term.params) == 1 and min(use.values.values(), default=0.0) < 0.0 == term.params[0].low:
        text += ", by so much less than the model holds"
    if use.onset is not None:
        text += f", from {use.onset:.1f} s on"
    text += f"; it accounts for {100 * gain_share:.0f} % of the mismatch that the parameters leave"
    if either:
        text += "; on which side of the gearbox it sits the data cannot tell"
    if rivals:
        others = ", ".join(rivals).replace("_", " ")
        text += f"; the data cannot tell it from {others}: {experiment([use.term, *rivals])}"
    return text + "."
