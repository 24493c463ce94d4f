"""Kalman innovations and a matched likelihood ratio over the fault library; the detector that sees most.

A finding reads: *torque_constant_change from 7.6 s on: the innovations lean 41.2 deviations towards it (limit 5.6).*

Scores of each direction are summed from every possible onset to the end of the batch, as a step and as a ramp. Their
spread is not taken from theory alone: fault-free batches say how far the scores of this joint wander, within a batch
and from batch to batch, and what the learnt model leaves unexplained in the mean.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy import stats

from gsfdi.detectors import Binned, Detector, Numbers
from gsfdi.directions import library
from gsfdi.nominal import Nominal, Watched, entries, observer, score
from gsfdi.types import Array, Finding

BIN = 0.25
"""Width of a bin of time at first [s]; onsets are found to about this."""
LEAST = 0.01
"""Share of the batch's information that must lie after an onset for it to be considered."""


class _Tally:
    """Scores and information of every direction, by bin of time."""

    def __init__(self, nominal: Nominal, settings: Mapping[str, float]) -> None:
        self.run = observer(nominal)
        self.directions = library(nominal.flexible, bool(nominal.velocity), temperature=False)
        self.entry = entries(nominal, self.run, self.directions)
        self.bins = Binned(BIN)
        self.joint = np.zeros((len(self.directions), len(self.directions)))

    def add(self, watched: Watched) -> None:
        bins, count = self.bins.place(watched.stretch.t)
        scored = score(self.run, self.entry, watched, self.directions, bins, count)
        self.bins.add("g", scored.g)
        self.bins.add("h", scored.h)
        self.bins.add("energy", scored.energy)
        self.joint += scored.H

    def numbers(self) -> dict[str, Array]:
        return {**self.bins.sums, "H": self.joint, "width": np.array([self.bins.width])}


def _blocks(values: Array, width: float, length: float) -> Array:
    """Sums over blocks of about `length` seconds."""
    per = max(1, round(length / width))
    return np.add.reduceat(values, np.arange(0, len(values), per), axis=0)


def learn(gathered: Sequence[Numbers], settings: Mapping[str, float]) -> dict[str, Array]:
    """Mean lean of each direction on fault-free batches, and how far it wanders within and between them."""
    g = np.array([one["g"].sum(axis=0) for one in gathered])
    h = np.array([one["h"].sum(axis=0) for one in gathered])
    n = np.array([one["energy"][:, 1].sum() for one in gathered])[:, None]
    parts = [
        tuple(_blocks(one[key], float(one["width"][0]), settings["block_s"]) for key in ("g", "h", "energy"))
        for one in gathered
    ]
    gb, hb, nb = (np.concatenate([part[i] for part in parts]) for i in range(3))
    lean, drift = _regressed(gb, hb, nb[:, 1:])
    g = g - lean * h - drift * n
    z2 = np.where(
        hb > 1e-3 * hb.max(axis=0), (gb - lean * hb - drift * nb[:, 1:]) ** 2 / np.maximum(hb, 1e-300), np.nan
    )
    with np.errstate(invalid="ignore"):
        within = np.maximum(1.0, np.nan_to_num(np.nanmean(z2, axis=0), nan=1.0))
    pooled = float(np.median(within))
    dof = max(len(gathered) - 1, 0)
    # Excess spread between batches, in the fault's own unit; few batches lean on what all directions show together.
    expected = within / np.maximum(h, 1e-300)
    excess = ((g / np.maximum(h, 1e-300)) ** 2 - expected * (dof / max(dof + 1, 1))) * (dof + 1) / max(dof, 1)
    between = np.maximum(excess.mean(axis=0), 0.0)
    return {"lean": lean, "drift": drift,
            "lean_var": within / np.maximum(h.sum(axis=0), 1e-300) + between / max(len(gathered), 1),
            "within": within, "pooled": np.array([pooled]), "between": between, "blocks": np.array([float(len(z2))]),
            "batches": np.array([float(len(gathered))]), "width": gathered[0]["width"]}  # fmt: skip


def _regressed(g: Array, h: Array, n: Array) -> tuple[Array, Array]:
    """What the learnt model leaves in the mean of the scores: in proportion to the information, and to time.

    Noise of the measured effort leans on every direction that the effort drives, at a rate that no motion changes.
    """
    w = 1.0 / np.maximum(h, 1e-6 * h.max(axis=0) + 1e-300)
    hh, hn, nn = (w * h * h).sum(axis=0), (w * h * n).sum(axis=0), (w * n * n).sum(axis=0)
    gh, gn = (w * g * h).sum(axis=0), (w * g * n).sum(axis=0)
    det = hh * nn - hn**2
    apart = det > 0.05 * hh * nn  # else the motion is too even to tell the two
    safe = np.where(apart, det, 1.0)
    lean = np.where(apart, (gh * nn - gn * hn) / safe, gh / np.maximum(hh, 1e-300))
    return lean, np.where(apart, (gn * hh - gh * hn) / safe, 0.0)


class Lean(NamedTuple):
    """How strongly the batch leans towards a direction: deviations, size, error, onset bin, form.

    ``robust`` is what is left of `z` without its strongest bins,
    ``gain`` the drop of the innovations' weighted squares.
    """

    z: float
    size: float
    error: float
    onset: int
    ramp: bool
    robust: float
    gain: float


def leans(numbers: Numbers, learnt: Numbers, settings: Mapping[str, float]) -> list[Lean]:
    """Strongest lean towards each direction over every onset, as a step and as a ramp."""
    h = numbers["h"]
    g = numbers["g"] - learnt["lean"] * h - learnt["drift"] * numbers["energy"][:, 1:]
    width = float(numbers["width"][0])
    t: Array = np.asarray(width * (np.arange(len(g)) + 0.5), dtype=np.float64)
    return [
        _strongest(g[:, j], h[:, j], t, float(learnt["within"][j]), float(learnt["between"][j] + learnt["lean_var"][j]))
        for j in range(g.shape[1])
    ]


def _tail(values: Array) -> Array:
    return np.cumsum(values[::-1])[::-1]


def _strongest(g: Array, h: Array, t: Array, within: float, between: float) -> Lean:
    if not h.sum() > 0:
        return Lean(0.0, 0.0, np.inf, 0, False, 0.0, 0.0)
    best = Lean(0.0, 0.0, np.inf, 0, False, 0.0, 0.0)
    G, H = _tail(g), _tail(h)
    t = t - t[-1]  # counted from the end, where ramps are short and differences would cancel
    Gt, Ht, Htt = _tail(t * g), _tail(t * h), _tail(t * t * h)
    start = t - 0.5 * (t[1] - t[0] if len(t) > 1 else 0.0)
    forms = (
        (False, G, H, H),
        (True, Gt - start * G, Htt - 2 * start * Ht + start**2 * H, Ht - start * H),
    )
    for ramp, top, info, weight in forms:
        info = np.maximum(info, 0.0)
        var = within * info + between * weight**2
        told = (LEAST * H[0] < H) & (t <= t[-1] - 1.0)
        z = np.where(told, top / np.sqrt(np.maximum(var, 1e-300)), 0.0)
        k = int(np.argmax(np.abs(z)))
        if abs(z[k]) > abs(best.z) * (1.05 if ramp else 1.0):
            shape = np.where(t >= t[k], (t - start[k]) if ramp else 1.0, 0.0)
            part = shape * g
            near = int(np.argmax(np.abs(part)))
            lone = part[max(near - 1, 0) : near + 2].sum()
            robust = (top[k] - lone) / np.sqrt(var[k])
            best = Lean(float(z[k]), float(top[k] / info[k]), float(np.sqrt(var[k]) / info[k]), k, ramp, float(robust),
                        float(top[k] ** 2 / info[k]))  # fmt: skip
    return best


def look(numbers: Numbers, learnt: Numbers, rate: float, settings: Mapping[str, float]) -> Finding | None:
    """Judge a batch by the strongest of its leans."""
    if not len(numbers.get("g", ())):
        return None
    found = leans(numbers, learnt, settings)
    looks = len(found) * (4.0 + 6.0 * np.log(max(len(numbers["g"]), 2)))
    dof = float(max(learnt["blocks"][0] - 1.0, 3.0))
    limit = float(stats.t.isf(rate / (2.0 * looks), dof))
    order = np.argsort([-abs(one.z) for one in found])
    j = int(order[0])
    best = found[j]
    width = float(numbers["width"][0])
    p = float(min(1.0, 2.0 * looks * stats.t.sf(abs(best.z), dof)))
    persists = abs(best.robust) > limit and np.sign(best.robust) == np.sign(best.z)
    onset = best.onset * width
    t = width * (np.arange(len(numbers["g"])) + 0.5)
    h = numbers["h"][:, j]
    g = numbers["g"][:, j] - learnt["lean"][j] * h - learnt["drift"][j] * numbers["energy"][:, 1]
    run = np.cumsum(g) / np.sqrt(np.maximum(learnt["within"][j] * np.cumsum(h), 1e-300))
    return Finding(
        "innovations", "parity", "", bool(abs(best.z) > limit and persists), p, abs(best.z), limit, "deviations",
        f"the innovations lean {abs(best.z):.1f} deviations (limit {limit:.1f})", float(onset),
        {"t": t, "residual": run, "threshold": limit, "z": np.array([one.z for one in found]),
         "size": np.array([one.size for one in found]), "error": np.array([one.error for one in found]),
         "onset": np.array([one.onset * width for one in found]), "ramp": np.array([float(one.ramp) for one in found]),
         "gain": np.array([one.gain for one in found]),
         "robust": np.array([one.robust for one in found]), "index": float(j)},
    )  # fmt: skip


DETECTOR = Detector(
    name="innovations",
    method="parity",
    needs=(),
    settings={"block_s": 5.0},
    tally=_Tally,
    learn=learn,
    look=look,
    false_alarm_rate=0.5,
    source="Willsky & Jones 1976 (generalised likelihood ratio); Basseville 1998 (local approach)",
)
