"""Kalman innovations and a matched likelihood ratio over the fault library; the detector that sees most.

A finding reads: *torque_constant_change from 7.6 s on: the innovations lean 41.2 deviations towards it (limit 5.6).*

Scores of each direction are summed from every possible onset to the end of the batch, as a step and as a ramp. Their
spread is not taken from theory alone: fault-free batches say how far the scores of this joint wander, within a batch
and from batch to batch, and what the learnt model leaves unexplained in the mean.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from gsfdi import student
from gsfdi.detectors import Binned, Detector, Numbers
from gsfdi.directions import Direction, grouped, library
from gsfdi.nominal import Nominal, Watched, entries, observer, score
from gsfdi.types import Array, Finding

BIN = 0.25
"""Width of a bin of time at first [s]; onsets are found to about this."""
CLEAR = 0.9
"""Share of the excess that one fault explains when it needs no part of the batch to be looked at alone."""
LOST = 0.7
"""Share of the drive by which a batch as a whole departs when the loop was lost."""
ENOUGH = 15.0
"""Deviations that the part before a runaway must show to be judged alone."""
LEAST = 0.01
"""Share of the batch's information that must lie after an onset for it to be considered."""


RAMP = 9.0
"""Further drop of the weighted squares for which a growing fault is preferred to a sudden one."""
END = 1.0
"""What a score's swing to and fro leaves at either end of a sum is looked up over this long [s]."""
APART = 0.02
"""Share of their information by which sine and cosine of a wave must differ to be two."""


class _Tally:
    """Scores and information of every direction, by bin of time."""

    def __init__(self, nominal: Nominal, settings: Mapping[str, float]) -> None:
        self.run = observer(nominal)
        self.kind = np.array([nominal.flexible, bool(nominal.velocity), False], dtype=np.float64)
        self.terms = np.array([float(sum(value != 0.0 for value in nominal.terms.values()))])
        self.directions = library(nominal.flexible, bool(nominal.velocity), temperature=False)
        self.entry = entries(nominal, self.run, self.directions)
        self.bins = Binned(BIN)
        self.joint = np.zeros((len(self.directions), len(self.directions)))

    def add(self, watched: Watched) -> None:
        bins, first, count = self.bins.place(watched.stretch.t)
        scored = score(self.run, self.entry, watched, self.directions, bins, count)
        self.bins.add("g", scored.g, first)
        self.bins.add("h", scored.h, first)
        self.bins.add("x", scored.x, first)
        self.bins.add("energy", scored.energy, first)
        self.joint += scored.H

    def numbers(self) -> dict[str, Array]:
        about = {"width": np.array([self.bins.width]), "kind": self.kind, "terms": self.terms}
        return {**self.bins.sums, "H": self.joint, **about}


def _blocks(values: Array, width: float, length: float) -> Array:
    """Sums over blocks of about `length` seconds."""
    per = max(1, round(length / width))
    return np.add.reduceat(values, np.arange(0, len(values), per), axis=0)


def learn(gathered: Sequence[Numbers], settings: Mapping[str, float]) -> dict[str, Array]:
    """Mean lean of each direction on fault-free batches, and how far it wanders within and between them."""
    length = settings["block_s"]
    blocks = [
        np.concatenate([_blocks(one[key], float(one["width"][0]), length) for one in gathered])
        for key in ("g", "h", "x", "energy")
    ]
    lean, drift = _regressed(blocks[0], blocks[1], blocks[3][:, 1:])
    clean = [cleaned(one, lean, drift) for one in gathered]
    gb = np.concatenate([_blocks(g, float(n["width"][0]), length) for g, n in zip(clean, gathered, strict=True)])
    g, h = np.array([one.sum(axis=0) for one in clean]), np.array([one["h"].sum(axis=0) for one in gathered])
    hb, xb = blocks[1], blocks[2]
    # The terms of the nominal joint were fitted to these very batches, and took as many blocks' worth of wander away.
    left = max(len(gb) - float(gathered[0]["terms"][0]), 1.0)
    within = np.maximum(1.0, len(gb) / left * _wander(gb, hb, xb, gathered[0]["kind"]))
    freedom = _freedom(gb, hb, within, gathered[0]["kind"], left)
    within = _met(within, freedom, gathered[0]["kind"])
    # Excess spread between batches, in the fault's own unit.
    dof = max(len(gathered) - 1, 1)
    expected = within / np.maximum(h, 1e-300) * dof / (dof + 1)
    excess = ((g / np.maximum(h, 1e-300)) ** 2 - expected) * (dof + 1) / dof
    between = np.maximum(excess.mean(axis=0), 0.0)
    lean_var = within / np.maximum(h.sum(axis=0), 1e-300) + between / len(gathered)
    shared = _shared(hb.sum(axis=0), xb.sum(axis=0), gathered[0]["kind"])
    return {
        "lean": lean, "drift": drift, "lean_var": lean_var, "within": within, "between": between, "shared": shared,
        "freedom": freedom,
        "swing": _swing(clean, gathered, within),
        "energy": np.array([blocks[3][:, 0].sum() / max(blocks[3][:, 1].sum(), 1.0)]),
        "pooled": np.array([np.median(within)]), "blocks": np.array([left]),
        "batches": np.array([float(len(gathered))]), "tolerance": np.array([settings["tolerance"]]),
    }  # fmt: skip


def cleaned(numbers: Numbers, lean: Array, drift: Array) -> Array:
    """Scores without what a fault-free joint shows in the mean; at rest no more than noise is taken from them."""
    h, count = numbers["h"], numbers["energy"][:, 1:]
    steady = np.sign(drift) * np.minimum(np.abs(drift) * count, 0.2 * np.sqrt(h))
    return np.asarray(numbers["g"] - lean * h - steady)


def _wander(g: Array, h: Array, x: Array, kind: Array) -> Array:
    """Mean square of the scores over blocks, in units of their information; pairs as the worst way through both."""
    z2 = np.where(h > 1e-3 * h.max(axis=0), g**2 / np.maximum(h, 1e-300), np.nan)
    seen = np.isfinite(z2).any(axis=0)
    mean = np.where(seen, np.nansum(z2, axis=0) / np.maximum(np.isfinite(z2).sum(axis=0), 1), 1.0)
    for _, members in grouped(_library(kind)):
        if len(members) == 2:
            j, k = members
            det = h[:, j] * h[:, k] - x[:, j] ** 2
            apart = (det > APART * h[:, j] * h[:, k]) & (h[:, j] > 1e-3 * h[:, j].max()) & (det > 0)
            square = h[:, k] * g[:, j] ** 2 - 2 * x[:, j] * g[:, j] * g[:, k] + h[:, j] * g[:, k] ** 2
            both = 0.5 * float(np.mean(square[apart] / det[apart])) if apart.any() else 1.0
            mean[members] = np.maximum(mean[members], both)
    return mean


def _library(kind: Array) -> tuple[Direction, ...]:
    """Directions of a joint of the kind that its numbers tell."""
    return library(*(bool(one) for one in kind))


def _freedom(g: Array, h: Array, within: Array, kind: Array, blocks: float) -> Array:
    """How many independent blocks each direction's wander was learnt from, as the spread of its squares tells.

    Where noise is all there is, scores are normal and every block counts. What a model lacks, as a rigid joint's model
    lacks the spring, leans on a wave only where the motion happens to meet it: nearly nothing in most blocks, and a
    hundred times the mean in a few. Such a mean is known no better than from those few (Satterthwaite 1946).
    """
    z2 = np.where(h > 1e-3 * h.max(axis=0), g**2 / np.maximum(h, 1e-300), np.nan)
    count = np.isfinite(z2).sum(axis=0)
    filled = np.where(np.isfinite(z2), z2, 0.0)
    mean = filled.sum(axis=0) / np.maximum(count, 1)
    square = (filled**2).sum(axis=0) / np.maximum(count, 1)
    uneven = np.where(count > 1, (square - mean**2) / np.maximum(2.0 * mean**2, 1e-300), 1.0)
    faults = np.array([one.fault for one in _library(kind)])
    for fault in set(faults):  # one direction alone says it poorly
        uneven[faults == fault] = uneven[faults == fault].mean()
    unexplained, told = 1.0 - 1.0 / within, np.maximum(count, 1) / len(g)  # a block without the motion tells nothing
    return np.asarray(np.maximum(blocks / (1.0 + (np.maximum(uneven, 1.0) / told - 1.0) * unexplained) - 1.0, 3.0))


def _met(within: Array, freedom: Array, kind: Array) -> Array:
    """Wander of each wave's orders, no less than what the worst of them surely shows.

    A wave leans on a mode that the model lacks where the motion turns it at the mode's frequency. Which order that is
    is up to how fast the motion was: the order that hardly met the mode in the baseline meets it in a motion of another
    speed. Sure is the lower end of a 95 % interval of all orders' mean squares, so that chance alone raises nothing.
    """
    directions, met = _library(kind), within.copy()
    waves = [j for _, members in grouped(directions) if len(members) == 2 for j in members]
    for fault in {directions[j].fault for j in waves}:
        orders = [j for j in waves if directions[j].fault == fault]
        sure = within[orders] * freedom[orders] / chdtri(freedom[orders], 0.5 * (1.0 - 0.95) / len(orders))
        met[orders] = np.maximum(met[orders], sure.max())
    return met


def _swing(clean: Sequence[Array], gathered: Sequence[Numbers], within: Array) -> Array:
    """How much more the scores wander over a moment than over a block, per unit of information.

    A model that is wrong in a mode of the joint leaves scores that swing to and fro with it. Over a block they cancel;
    a batch that is cut short in the middle of a motion ends on half a swing.
    """
    kind, moments = gathered[0]["kind"], []
    for g, one in zip(clean, gathered, strict=True):
        moments.append([_blocks(some, float(one["width"][0]), END) for some in (g, one["h"], one["x"])])
    g, h, x = (np.concatenate(some) for some in zip(*moments, strict=True))
    return np.asarray(np.maximum(_wander(g, h, x, kind) - within, 0.0))


def _shared(h: Array, x: Array, kind: Array) -> Array:
    """Correlation of each direction's score with its mate's in the baseline's motion; 0 where it has none."""
    shared = np.zeros(len(h))
    for _, members in grouped(_library(kind)):
        if len(members) == 2:
            shared[members] = np.clip(x[members] / np.sqrt(np.maximum(h[members].prod(), 1e-300)), -1.0, 1.0)
    return shared


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
    """How strongly the batch leans towards a fault.

    ``z`` in deviations, ``robust`` what is left of it without its strongest bins; ``gain`` the drop of the innovations'
    weighted squares; ``size`` and ``error`` of the fault's parameter (of a wave, its amplitude); ``onset`` a bin;
    ``ramp`` whether it grows from there.
    """

    name: str
    z: float
    robust: float
    gain: float
    size: float
    error: float
    onset: int
    ramp: bool
    members: tuple[int, ...]


class _Sums(NamedTuple):
    """From every possible onset to the end: score (onsets, k), its information and covariance (onsets, k, k)."""

    g: Array
    info: Array
    cov: Array


def leans(numbers: Numbers, learnt: Numbers, directions: Sequence[Direction]) -> list[Lean]:
    """Strongest lean towards each fault over every onset, as a step and as a ramp."""
    g, h = cleaned(numbers, learnt["lean"], learnt["drift"]), numbers["h"]
    t = np.asarray(float(numbers["width"][0]) * (np.arange(len(g)) + 0.5), dtype=np.float64)
    torque = _torque(directions)
    misfit = float(learnt["tolerance"][0]) ** 2 * h[:, torque]
    found = []
    for name, members in grouped(directions):
        if h[:, members].sum() > 0:
            cross = numbers["x"][:, members[0]] if len(members) == 2 else None
            spread = _Spread(learnt["within"][members], learnt["swing"][members], _doubt(learnt, members), misfit)
            found.append(_strongest(name, tuple(members), g[:, members], h[:, members], cross, t, spread))
    return [_as_likely(one, learnt) for one in found]


def _as_likely(lean: Lean, learnt: Numbers) -> Lean:
    """Deviations that are as unlikely with the freedom of all blocks as the lean's are with its own."""
    if "freedom" not in learnt:  # a baseline that was learnt before this was told
        return lean
    freedom, own = freedom_of(learnt), float(learnt["freedom"][list(lean.members)].min())
    if own >= freedom:
        return lean
    z, robust = (student.limit(max(student.beyond(some, own), 1e-300), freedom) for some in (lean.z, lean.robust))
    return lean._replace(z=min(z, lean.z), robust=min(robust, lean.robust))


def freedom_of(learnt: Numbers) -> float:
    """Degrees of freedom with which a baseline knows how far scores wander."""
    return float(max(learnt["blocks"][0] - 1.0, 3.0))


def _doubt(learnt: Numbers, members: Sequence[int]) -> Array:
    """Covariance of what the baseline takes from each score per unit of its information, and of its own variation.

    What a baseline learnt of a sine and a cosine it learnt from the same samples: in a motion that hardly tells them
    apart both are off together, and their difference, which is next to nothing there, is off by far more than it is.
    """
    root = np.sqrt(learnt["between"][members] + learnt["lean_var"][members])
    together = np.eye(len(members))
    if len(members) == 2:
        together[[0, 1], [1, 0]] = learnt["shared"][members[0]]
    return np.asarray(together * np.outer(root, root))


def _tail(values: Array) -> Array:
    return np.asarray(np.cumsum(values[::-1], axis=0)[::-1])


class _Spread(NamedTuple):
    """How far the scores of one fault wander on a fault-free joint.

    ``within`` per unit of information, ``swing`` besides at either end of a sum, ``doubt`` what the baseline's mean and
    its batches add, ``misfit (bins,)`` what a model that is a little off could.
    """

    within: Array
    swing: Array
    doubt: Array
    misfit: Array


def _sums(g: Array, info: Array, late: Array, spread: _Spread, ramp: bool) -> _Sums:
    """Sums from each onset on; `late` counts time from the end, where ramps are short and differences would cancel."""
    top, H, H1, off = _tail(g), _tail(info), _tail(info), _tail(spread.misfit)
    last = _ends(info, late, ramp)
    if ramp:
        start = late - 0.5 * (late[1] - late[0] if len(late) > 1 else 0.0)
        s1, s2 = start[:, None], start[:, None, None]
        t2 = late[:, None, None]
        top = _tail(late[:, None] * g) - s1 * top
        H1 = _tail(t2 * info) - s2 * H
        H = _tail(t2 * t2 * info) - 2 * s2 * _tail(t2 * info) + s2**2 * H
    root, swing = np.sqrt(spread.within), np.sqrt(spread.swing)
    own = np.diagonal(H1, axis1=1, axis2=2)  # the baseline took from each score in proportion to its own information
    # A model that is off by a share of the drive's effect can lean on anything, by Cauchy and Schwarz, this much: what
    # is off need not grow with a ramp, so its own squares are those of a step.
    cov = H * (root[:, None] * root + off[:, None, None]) + own[:, :, None] * spread.doubt * own[:, None, :]
    cov = cov + last * (swing[:, None] * swing)
    return _Sums(top, H, cov)


def _ends(info: Array, late: Array, ramp: bool) -> Array:
    """Information in `END` seconds from each onset on, where a ramp is still nothing, and before the batch's end."""
    width = late[1] - late[0] if len(late) > 1 else END
    whole = np.cumsum(np.concatenate([np.zeros((1, *info.shape[1:])), info]), axis=0) * min(END / width, 1.0)
    at, bins = np.arange(len(info)), max(round(END / width), 1)
    final = whole[-1] - whole[max(len(info) - bins, 0)]
    if ramp:
        start = late - 0.5 * width
        return np.asarray(start[:, None, None] ** 2 * final)
    return np.asarray(whole[np.minimum(at + bins, len(info))] - whole[:-1] + final)


def _deviations(top: Array, cov: Array) -> Array:
    """Deviations of a score from zero; of a pair, those of a single one as unlikely."""
    if top.shape[1] == 1:
        return np.abs(top[:, 0]) / np.sqrt(np.maximum(cov[:, 0, 0], 1e-300))
    det = cov[:, 0, 0] * cov[:, 1, 1] - cov[:, 0, 1] ** 2
    apart = det > APART * cov[:, 0, 0] * cov[:, 1, 1]  # else the two waves are one in this motion
    square = (
        cov[:, 1, 1] * top[:, 0] ** 2 - 2 * cov[:, 0, 1] * top[:, 0] * top[:, 1] + cov[:, 0, 0] * top[:, 1] ** 2
    ) / np.where(apart, det, 1.0)
    single = np.max(top**2 / np.maximum(np.diagonal(cov, axis1=1, axis2=2), 1e-300), axis=1)
    square = np.where(apart, square, single)
    return np.sqrt(np.maximum(square - np.log(np.maximum(0.5 * np.pi * square, 1.0)), 0.0))


def _strongest(
    name: str,
    members: tuple[int, ...],
    g: Array,
    h: Array,
    cross: Array | None,
    t: Array,
    spread: _Spread,
) -> Lean:
    """Best onset and form for one fault."""
    k = len(members)
    info = np.zeros((len(g), k, k))
    info[:, range(k), range(k)] = h
    if cross is not None:
        info[:, 0, 1] = info[:, 1, 0] = cross
    late = t - t[-1]
    tail = _tail(h)
    told = (tail > LEAST * tail[0]).all(axis=1) & (late <= -1.0)
    best = Lean(name, 0.0, 0.0, 0.0, 0.0, np.inf, 0, False, members)
    for ramp in (False, True):
        sums = _sums(g, info, late, spread, ramp)
        safe = np.diagonal(sums.info, axis1=1, axis2=2) > (1e-5 * late[:, None] ** 2 * tail if ramp else 0.0)
        # Where nothing was scored a step could have set in anywhere: it is dated to where it was first seen.
        dated = told & (ramp | (h > 0).any(axis=1))
        gain = np.where(dated & safe.all(axis=1), _deviations(sums.g, sums.info), 0.0) ** 2
        at = int(np.argmax(gain))
        if gain[at] > best.gain * (1.001 if ramp else 1.0) + (RAMP if ramp else 0.0):
            best = _described(best, g, sums, late, at, ramp)
    return best


def _described(lean: Lean, g: Array, sums: _Sums, late: Array, at: int, ramp: bool) -> Lean:
    start = late[at] - 0.5 * (late[1] - late[0])
    shape = np.where(late >= late[at], late - start if ramp else 1.0, 0.0)
    info = sums.info[at]
    scale = 1.0 / np.sqrt(np.maximum(np.diag(info), 1e-300))
    solve = scale[:, None] * np.linalg.pinv(scale[:, None] * info * scale, rcond=0.5 * APART, hermitian=True) * scale
    size = solve @ sums.g[at]
    z = float(_deviations(sums.g[at][None], sums.cov[at][None])[0])
    part = shape[:, None] * g
    near = int(np.argmax(np.abs(part @ size)))
    lone = part[max(near - 1, 0) : near + 2].sum(axis=0)
    robust = float(_deviations((sums.g[at] - lone)[None], sums.cov[at][None])[0])
    if (sums.g[at] - lone) @ size <= 0:
        robust = 0.0
    error = float(np.sqrt(np.max(np.diag(solve @ sums.cov[at] @ solve))))
    whole = float(size[0]) if len(size) == 1 else float(np.linalg.norm(size))
    gain = float(sums.g[at] @ solve @ sums.g[at])
    return lean._replace(z=z, robust=robust, gain=gain, size=whole, error=error, onset=at, ramp=ramp)


def _whole(numbers: Numbers, learnt: Numbers, found: Sequence[Lean]) -> tuple[Array, Array, Array]:
    """Size and error of each fault as if it acted all through the batch, and what a unit of it takes of the drive.

    That share is the change of the torque constant which would displace the joint as much.
    """
    g, h = cleaned(numbers, learnt["lean"], learnt["drift"]).sum(axis=0), numbers["h"].sum(axis=0)
    kind = numbers["kind"]
    directions = _library(kind)
    torque = _torque(directions)
    misfit = float(learnt["tolerance"][0]) ** 2 * h[torque]
    rows = []
    for one in found:
        j = list(one.members)
        info = np.maximum(h[j], 1e-300)
        size = float(g[j][0] / info[0]) if len(j) == 1 else float(np.linalg.norm(g[j] / info))
        variance = (learnt["within"][j] + misfit) / info + learnt["between"][j] + learnt["lean_var"][j]
        ratio = directions[j[0]].neutral == 1.0
        rows.append(
            (
                size,
                float(np.sqrt(variance.max())),
                1.0 if ratio else float(np.sqrt(info.max() / max(h[torque], 1e-300))),
            )
        )
    sizes, errors, factors = np.array(rows).T
    return sizes, errors, factors


def before_runaway(numbers: Numbers, learnt: Numbers) -> Numbers:
    """Bins before the joint departs from its baseline by a third of what drives it, where directions stop being small.

    A loop that has gone unstable says nothing more of what made it so; what came before does.
    """
    energy, h = numbers["energy"], numbers["h"]
    torque = _torque(_library(numbers["kind"]))
    span = max(1, round(2.0 / float(numbers["width"][0])))
    ones = np.ones(span)
    usual = float(learnt["energy"][0])
    excess = np.convolve(energy[:, 0] - usual * energy[:, 1], ones, mode="full")[: len(h)]
    driven = np.convolve(h[:, torque], ones, mode="full")[: len(h)]
    count = np.convolve(energy[:, 1], ones, mode="full")[: len(h)]
    gone = (excess > 0.09 * driven) & (excess > 100.0 * usual * count) & (count > 0)
    if not gone.any():
        return numbers
    end = max(int(np.argmax(gone)), 1)
    return first_bins(numbers, end)


def _excess(numbers: Numbers, learnt: Numbers) -> float:
    energy = numbers["energy"].sum(axis=0)
    return float(energy[0] - energy[1] * learnt["energy"][0])


def _told(found: Sequence[Lean], numbers: Numbers, learnt: Numbers) -> float:
    """Share of what goes beyond a fault-free batch that the best single fault accounts for."""
    return max(one.gain for one in found) / max(_excess(numbers, learnt), 1e-300)


def _torque(directions: Sequence[Direction]) -> int:
    return [one.fault for one in directions].index("torque_constant_change")


def first_bins(numbers: Numbers, count: int) -> Numbers:
    """Only the first `count` bins of a batch."""
    return {key: some[:count] if key in ("g", "h", "x", "energy") else some for key, some in numbers.items()}


def look(numbers: Numbers, learnt: Numbers, rate: float, settings: Mapping[str, float]) -> Finding | None:
    """Judge a batch by the strongest of its leans."""
    if not len(numbers.get("g", ())) or float(numbers["h"].sum()) <= 0:
        return None
    kind = numbers["kind"]
    directions = _library(kind)
    early, found = numbers, leans(numbers, learnt, directions)
    calm = before_runaway(numbers, learnt)
    lost = _excess(numbers, learnt) > LOST**2 * float(numbers["h"][:, _torque(directions)].sum())
    if len(calm["g"]) < len(numbers["g"]) and (lost or _told(found, numbers, learnt) < CLEAR):
        before = leans(calm, learnt, directions)
        better = lost or _told(before, calm, learnt) > _told(found, numbers, learnt)
        if better and max((one.robust for one in before), default=0.0) > ENOUGH:
            early, found = calm, before
    looks = len(found) * (4.0 + 6.0 * np.log(max(len(numbers["g"]), 2)))
    dof = freedom_of(learnt)
    limit = student.limit(rate / (2.0 * looks), dof)
    lasting = [one for one in found if one.robust > limit]
    best = max(lasting or found, key=lambda one: one.z)
    width = float(numbers["width"][0])
    p = float(min(1.0, 2.0 * looks * student.beyond(best.robust if not lasting else best.z, dof)))
    named = max(lasting or found, key=lambda one: one.gain)
    j = list(named.members)
    g, h = cleaned(early, learnt["lean"], learnt["drift"])[:, j], early["h"][:, j]
    run = np.cumsum(g, axis=0) / np.sqrt(np.maximum(learnt["within"][j] * np.cumsum(h, axis=0), 1e-300))
    residual = run[:, int(np.argmax(np.abs(run[-1])))]
    sizes, errors, factors = _whole(numbers, learnt, found)
    evidence: dict[str, object] = {
        "t": width * (np.arange(len(g)) + 1.0), "residual": residual, "threshold": limit,
        "names": [one.name for one in found], "ramp": np.array([float(one.ramp) for one in found]),
        "onset": np.array([one.onset * width for one in found]), "judged_bins": float(len(early["g"])),
        "share": sizes * factors, "share_error": errors * factors,
        **{key: np.array([getattr(one, key) for one in found]) for key in ("z", "robust", "gain", "size", "error")},
    }  # fmt: skip
    return Finding(
        "innovations", "parity", "", bool(lasting), p, best.z, limit, "deviations",
        f"the innovations lean {best.z:.1f} deviations towards {best.name.replace('_', ' ')} (limit {limit:.1f})",
        named.onset * width, evidence,
    )  # fmt: skip


DETECTOR = Detector(
    name="innovations",
    method="parity",
    needs=(),
    settings={"block_s": 5.0, "tolerance": 3e-4},
    tally=_Tally,
    learn=learn,
    look=look,
    false_alarm_rate=0.5,
    source="Willsky & Jones 1976 (generalised likelihood ratio); Basseville 1998 (local approach)",
)
