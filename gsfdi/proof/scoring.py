"""Scores of one answer against the truth of its case.

What counts, decided before any answer was seen:

- Names that only correct a number of the nominal model that really is off (`nominal_off`, `known_off`) are neither
  right nor wrong: they are set aside before the first name is read. Naming a number that is not off is a discovery.
- The first name is right when it is the true term; an equivalent (`kinds.EQUIVALENT`) covers, but is not right; right
  or tied is also an equivalent whose answer lists the true term beside it as not to be told apart.
- The set is every name given, and whatever the answer lists as indistinguishable from one of them.
- A parameter in N m (N) is compared after scaling by the torque constant that the answer believes in: multiplying
  torque constant, stiffness and both inertias by one number changes nothing that is measured, so no tool could do
  better. Angles that say where (centre, rest, angle) are compared in units of the range of motion, orders must match
  when rounded, phases and parameters of laws that differ in shape from the contract's are left out.
- An onset is right within 2 s or 3 % of the recording, whichever is more.
- Visible means at least `VISIBLE` standard deviations in `concealment`; below it silence is as good as the true name.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from gsfdi.proof.world import spelled as parameter_name

VISIBLE = 30.0
PLACES = ("centre_rad", "rest_rad", "angle_rad")
OTHER_LAW = ("magnetic_saturation",)
QUIET = ("no_mismatch", "not_enough_data")
PUZZLED = ("unexplained", "partly_explained")


def score(truth: Mapping[str, Any], reply: Mapping[str, Any]) -> dict[str, Any]:
    """Score one stored reply.

    Parameters
    ----------
    truth : mapping
        What the seal holds of the case.
    reply : mapping
        What `running.examine` stored of the tool's answer.

    Returns
    -------
    dict
        Flags and numbers by name; None where a question does not arise.
    """
    joint = _joint_of(reply)
    base: dict[str, Any] = {
        "group": truth["group"],
        "kinds": truth["kinds"],
        "size": truth["size"],
        "seconds": reply["seconds"],
    }
    base |= {"concealment": truth.get("concealment"), "answered": joint is not None}
    base["rivals"] = {rival: _rival(truth, said) for rival, said in reply.get("rivals", {}).items()}
    if joint is None or reply["trespasses"]:
        return base | _void(truth, bool(reply["trespasses"]))
    named = names(truth, joint)
    true = [effect["term"] for effect in truth["effects"] if not _sham(effect)]
    wide = _set_of(joint, named)
    equal = {other for effect in truth["effects"] for other in effect["equivalents"]}
    stranger = truth["group"] in ("unknown", "withheld")
    return base | {
        "trespassed": False,
        "verdict": joint["verdict"],
        "named": named,
        "set_size": len(wide),
        "true": true,
        "visible": is_visible(truth),
        "first_right": None if not true or stranger else bool(named) and named[0] in true,
        "first_equivalent": None if not true or stranger else bool(named) and named[0] in {*true, *equal},
        "first_or_tied": None if not true or stranger else _right_or_tied(joint, named, true, equal),
        "covered": None if not true or stranger else bool(set(true) & wide) or bool(equal & wide),
        "all_named": None if not true or stranger else set(true) <= set(named),
        "extra": [name for name in named if name not in true and name not in equal],
        "silent": joint["verdict"] in QUIET,
        "puzzled": joint["verdict"] in PUZZLED,
        "said": [] if stranger else list(_said(joint, named, true)),
        "located": _located(truth, joint),
        **_onset(truth, joint),
        "parameters": [] if stranger else list(_parameters(truth, joint)),
        "fit": _fit(truth, joint),
    }


def _rival(truth: Mapping[str, Any], said: Sequence[str]) -> dict[str, Any]:
    """What a rival named, held to the same rule."""
    named = names(truth, {"omitted_physics": [{"term": name} for name in said]})
    true = [effect["term"] for effect in truth["effects"] if not _sham(effect)]
    asked = bool(true) and truth["group"] not in ("unknown", "withheld")
    return {"named": named, "first_right": (bool(named) and named[0] in true) if asked else None}


def is_visible(truth: Mapping[str, Any]) -> bool:
    """Whether what acts can be seen at all."""
    return not truth["effects"] or truth.get("concealment", {}).get("visible", math.inf) >= VISIBLE


def _void(truth: Mapping[str, Any], trespassed: bool) -> dict[str, Any]:
    """Score of no answer, or of one that was got by trespass: wrong wherever a question arises."""
    asked = None if not truth["effects"] or truth["group"] in ("unknown", "withheld") else False
    flags = dict.fromkeys(("first_right", "first_equivalent", "first_or_tied", "covered", "all_named"), asked)
    return {
        **flags,
        "trespassed": trespassed,
        "verdict": None,
        "named": [],
        "set_size": 0,
        "true": [effect["term"] for effect in truth["effects"]],
        "visible": is_visible(truth),
        "extra": [],
        "silent": False,
        "puzzled": False,
        "said": [],
        "located": None if not truth["effects"] else False,
        "onset_right": None,
        "onset_error_s": None,
        "parameters": [],
        "fit": None,
    }


def _joint_of(reply: Mapping[str, Any]) -> Mapping[str, Any] | None:
    answer = reply.get("answer")
    joints: Sequence[Mapping[str, Any]] = answer.get("joints", []) if isinstance(answer, Mapping) else []
    return joints[0] if joints else None


def named_in(reply: Mapping[str, Any]) -> list[str]:
    """Terms that a stored reply names, in its order."""
    return [str(entry["term"]) for entry in (_joint_of(reply) or {}).get("omitted_physics", [])]


def _sham(effect: Mapping[str, Any]) -> bool:
    """Whether the effect is a controller's: named by its component, as the contract has no term for it."""
    return str(effect["term"]).startswith("controller_")


def names(truth: Mapping[str, Any], joint: Mapping[str, Any]) -> list[str]:
    """Terms the answer names, in its order, without those that correct numbers which really are off."""
    aside = {*truth["nominal_off"], *truth["known_off"]} - {effect["term"] for effect in truth["effects"]}
    given = [str(entry["term"]) for entry in joint.get("omitted_physics", [])]
    return list(dict.fromkeys(name for name in given if name not in aside and not name.startswith("controller_")))


def _said(joint: Mapping[str, Any], named: Iterable[str], true: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Give the probability that the answer gave each name that counts, and whether that is a true one."""
    for entry in joint.get("omitted_physics", []):
        if entry["term"] in named and entry.get("probability") is not None:
            yield {"probability": float(entry["probability"]), "right": entry["term"] in true}


def _set_of(joint: Mapping[str, Any], named: Iterable[str]) -> set[str]:
    wide = set(named)
    for group in joint.get("indistinguishable", []):
        if wide & set(group) or not wide:
            wide |= set(group)
    return wide


def _right_or_tied(joint: Mapping[str, Any], named: Sequence[str], true: Sequence[str], equal: Iterable[str]) -> bool:
    """Whether the true term came first, or an equivalent that is listed as not to be told from it."""
    if not named or named[0] in true:
        return bool(named)
    return named[0] in equal and bool(_set_of(joint, named[:1]) & set(true))


def _located(truth: Mapping[str, Any], joint: Mapping[str, Any]) -> bool | None:
    if not truth["effects"]:
        return None
    place = (joint.get("location") or {}).get("component")
    return place in {effect["component"] for effect in truth["effects"]}


def _onset(truth: Mapping[str, Any], joint: Mapping[str, Any]) -> dict[str, Any]:
    onsets = [effect["onset_s"] for effect in truth["effects"] if effect["onset_s"] is not None]
    if not onsets:
        return {"onset_right": None, "onset_error_s": None}
    when = (joint.get("location") or {}).get("when") or []
    if not when:
        return {"onset_right": False, "onset_error_s": None}
    error = min(abs(float(when[0]["from_s"]) - onset) for onset in onsets)
    return {"onset_right": error <= max(2.0, 0.03 * truth["seconds"]), "onset_error_s": error}


def _parameters(truth: Mapping[str, Any], joint: Mapping[str, Any]) -> Iterable[dict[str, Any]]:
    """Error and coverage of every parameter of every true term that the answer names."""
    given = {str(entry["term"]): entry for entry in joint.get("omitted_physics", [])}
    scale = _torque_scale(truth, joint)
    for effect in truth["effects"]:
        entry = given.get(effect["term"])
        if entry is None or effect["variant"] or effect["term"] in OTHER_LAW:
            continue
        for name, value in effect["parameters"].items():
            told = entry.get("parameters", {}).get(parameter_name(name, truth["axis"]))
            if told is None or name.startswith("phase") or name == "onset_s":
                continue
            factor = scale if "_nm" in name or "kg_m2" in name else 1.0
            low, high = (told.get("ci95") or [math.nan, math.nan])[:2]
            yield {
                "term": effect["term"],
                "parameter": name,
                "error": _error(name, value, told["value"] / factor, truth["scales"]["reach"]),
                "covered": bool(low / factor <= value <= high / factor)
                if _finite(low, high) and name != "order"
                else None,
            }


def _finite(*values: object) -> bool:
    return all(isinstance(value, (int, float)) and math.isfinite(value) for value in values)


def _error(name: str, value: float, told: float, reach: float) -> float:
    if name in PLACES:
        return abs(told - value) / (2.0 * reach)
    if name == "order":
        return 0.0 if round(told) == round(value) else 1.0
    return abs(told - value) / abs(value) if value else abs(told)


def _torque_scale(truth: Mapping[str, Any], joint: Mapping[str, Any]) -> float:
    """Torque constant of the answer's model over the true one."""
    if any(effect["term"] == "torque_constant_change" for effect in truth["effects"]):
        return 1.0
    true = truth["nominal_off"].get("torque_constant_change", 1.0)
    believed = (joint.get("parameters") or {}).get("torque_constant_change") or {}
    return float(believed.get("ratio", 1.0) / true)


def _fit(truth: Mapping[str, Any], joint: Mapping[str, Any]) -> dict[str, Any] | None:
    """Held-out misfit of every channel before and after, over what the true world itself would leave."""
    fit, oracle = joint.get("fit"), truth.get("oracle", {})
    if not fit:
        return None
    rows = {}
    for column, after in (fit.get("after") or {}).items():
        before = (fit.get("before") or {}).get(column)
        if _finite(before, after) and oracle.get(column):
            rows[column] = {"before": before, "after": after, "oracle": oracle[column]}
    return rows
