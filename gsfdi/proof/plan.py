"""Which cases a proof holds: strata in fixed shares, dealt so that even twenty cases span the kinds."""

from collections.abc import Iterator, Sequence
from itertools import islice

import numpy as np

from gsfdi.proof.cases import Design, Group
from gsfdi.proof.kinds import KINDS
from gsfdi.proof.mujoco_world import MUJOCO_KINDS, available
from gsfdi.proof.sizes import Rng

SHARES = {
    "single": 0.56,
    "null": 0.18,
    "double": 0.1,
    "triple": 0.02,
    "unknown": 0.08,
    "withheld": 0.04,
    "little": 0.02,
}
"""Shares of the groups; single includes sensors, controllers and parameters that are off."""

UNMIXED = ("quantisation", "timestamp_latency", "current_limit", "end_stop", "actuation_delay")
"""Kinds left out of doubles and triples, where they would hide or cut off whatever else there is."""

MERGED = {"constant_load", "cable_harness"}
"""Kinds that are one effect together, and so not mixed: a constant torque moves the angle at which a cable rests."""


def plan(count: int, seed: int) -> list[Design]:
    """Lay out `count` designs: groups by `SHARES` (largest remainder), kinds and sizes in turn within each group."""
    rng = np.random.default_rng((seed, 77))
    exact = {group: share * count for group, share in SHARES.items()}
    shares = {group: int(value) for group, value in exact.items()}
    for group in sorted(exact, key=lambda name: shares[name] - exact[name])[: count - sum(shares.values())]:
        shares[group] += 1
    return [design for group, n in shares.items() for design in islice(DEALS[group](rng), n)]


def full(
    seed: int, each: int = 8, nulls: int = 100, doubles: int = 40, triples: int = 8, unknown: int = 4
) -> list[Design]:
    """Lay out the whole proof: every kind `each` times, two per size, and the other groups beside them."""
    rng = np.random.default_rng((seed, 78))
    singles = list(islice(_singles(rng), each * len(_named("physics", "parameter", "sensor", "controller"))))
    strangers = len(_named("unknown")) * unknown
    withheld = islice(_withheld(rng), strangers // 2)
    return [
        *singles,
        *islice(_nulls(rng), nulls),
        *islice(_doubles(rng), doubles),
        *islice(_triples(rng), triples),
        *islice(_strangers(rng), strangers),
        *withheld,
        *islice(_little(rng), doubles // 4),
        *islice(_second_world(rng), doubles // 2),
    ]


def _named(*families: str) -> list[str]:
    return [name for name, kind in KINDS.items() if kind.family in families]


def _turns(names: Sequence[str], rng: Rng) -> Iterator[tuple[str, int]]:
    """Every name once in random order, then again, with the number of the round."""
    turn = 0
    while True:
        for name in rng.permutation(names):
            yield str(name), turn
        turn += 1


def _singles(rng: Rng) -> Iterator[Design]:
    names = _named("physics", "parameter", "sensor", "controller")
    sizes = ("plain", "moderate", "small", "hidden")
    for place, (name, turn) in enumerate(_turns(names, rng)):
        yield Design("single", (name,), sizes[(turn + place) % 4])


def _nulls(rng: Rng) -> Iterator[Design]:
    turn = 0
    while True:
        turn += 1
        yield Design("null", exact_nominal=turn % 4 == 0)


def _mixed(rng: Rng, many: int) -> tuple[str, ...]:
    """Kinds that act together: of different terms, in a joint that can have them all."""
    names = [name for name in _named("physics") if name not in UNMIXED and "/" not in name]
    drawn = tuple(str(name) for name in rng.choice(names, many, replace=False))
    return drawn if len(MERGED & set(drawn)) < 2 else _mixed(rng, many)


def _doubles(rng: Rng) -> Iterator[Design]:
    for place in range(1_000_000):
        yield Design("double", _mixed(rng, 2), ("plain", "moderate")[place % 2])


def _triples(rng: Rng) -> Iterator[Design]:
    while True:
        yield Design("triple", _mixed(rng, 3), "plain")


def _strangers(rng: Rng) -> Iterator[Design]:
    for name, turn in _turns(_named("unknown"), rng):
        yield Design("unknown", (name,), ("plain", "moderate")[turn % 2])


def _withheld(rng: Rng) -> Iterator[Design]:
    names = [name for name in _named("physics") if "/" not in name and name not in UNMIXED]
    for name, turn in _turns(names, rng):
        yield Design("withheld", (name,), ("plain", "moderate")[turn % 2])


def _little(rng: Rng) -> Iterator[Design]:
    for name, _ in _turns(_named("physics"), rng):
        yield Design("little", (name,), "plain")


def _second_world(rng: Rng) -> Iterator[Design]:
    """MuJoCo's cases; the own world's where MuJoCo is not installed."""
    group: Group = "mujoco" if available() else "single"
    for place, (name, _) in enumerate(_turns(MUJOCO_KINDS, rng)):
        yield Design(group, (name,), ("plain", "moderate")[place % 2])


DEALS = {
    "single": _singles,
    "null": _nulls,
    "double": _doubles,
    "triple": _triples,
    "unknown": _strangers,
    "withheld": _withheld,
    "little": _little,
    "mujoco": _second_world,
}
