"""Signal analysis: magnitudes, means, extremes, spreads, trends and correlations, by kind of motion.

A finding reads: *effort rms while slewing is 6.1 deviations above its baseline.*

Each feature is the median of its values over short blocks, so that no lone sample moves it, and is held against the
batches of the baseline. This is the family that the paper holds up the others against: it knows no model, so whatever a
different motion changes counts as normal variation.
"""

from collections.abc import Mapping, Sequence

import numba
import numpy as np

from gsfdi import student
from gsfdi.detectors import Detector, Numbers
from gsfdi.nominal import Nominal, Watched
from gsfdi.types import Array, Finding

POINTS = 1500
"""Most points per plotted signal."""
SHOWN = ("setpoint", "position", "effort", "velocity", "tracking")


class _Tally:
    """Values of every feature by block, and thinned signals for the page."""

    def __init__(self, nominal: Nominal, settings: Mapping[str, float]) -> None:
        self.nominal, self.block = nominal, max(int(settings["block_s"] / nominal.step), 20)
        self.rows: list[Array] = []
        self.shown = Thinned()

    def add(self, watched: Watched) -> None:
        values = watched.stretch.values
        position, effort = values["position"], values[self.nominal.effort]
        speed = watched.moving.speed
        tracking = values["setpoint"] - position if "setpoint" in values else np.full(len(position), np.nan)
        nan = np.full(len(position), np.nan)
        velocity = values[self.nominal.velocity] if self.nominal.velocity else nan
        columns = [watched.stretch.t, values.get("setpoint", nan), position, effort, velocity, tracking]
        self.shown.add(np.column_stack(columns))
        whole = [np.ascontiguousarray(some) for some in (speed, effort, tracking)]
        rows = np.empty((len(position) // self.block, len(FEATURES)))  # one array: what stays must not lie scattered
        for at, row in enumerate(rows):
            part = slice(at * self.block, (at + 1) * self.block)
            row[:] = _features(*(some[part] for some in whole), self.nominal.slow, self.nominal.step)
        if len(rows):
            self.rows.append(rows)

    def numbers(self) -> dict[str, Array]:
        if not self.rows:
            return {}
        found = {}
        for name, column in zip(FEATURES, np.concatenate(self.rows).T, strict=True):
            known = column[np.isfinite(column)]
            halves = [known[: len(known) // 2], known[len(known) // 2 :]]
            medians = [np.median(some) if len(some) else np.nan for some in (known, *halves)]
            scatter = np.var(_scaled(name, known), ddof=1) if len(known) > 1 else np.nan
            found[name] = np.array([*medians, scatter, len(known)])
        shown = self.shown.rows()
        return {**found, "shown": shown[:: max(1, len(shown) // POINTS)].copy()}


class Thinned:
    """Rows of which every so manieth is kept, none of them invented; fewer and fewer, so that memory stays flat."""

    def __init__(self) -> None:
        self._every, self._seen = 1, 0
        self._parts: list[Array] = []

    def add(self, rows: Array) -> None:
        """Take in more rows.

        Parameters
        ----------
        rows : (n, k) array
        """
        self._parts.append(rows[-self._seen % self._every :: self._every].copy())
        self._seen += len(rows)
        while sum(len(part) for part in self._parts) > 4 * POINTS:
            self._every *= 2
            self._parts = [self.rows()[::2].copy()]

    def rows(self) -> Array:
        """What was kept."""
        return np.concatenate(self._parts)


FEATURES = (
    "effort mean while slewing", "effort rms while slewing", "effort spread while slewing", "effort peak",
    "effort mean at rest", "effort rms at rest", "effort asymmetry of direction", "effort against acceleration",
    "tracking rms while slewing", "tracking mean while slewing", "tracking peak", "tracking mean at rest",
    "rate error rms while slewing", "tracking trend",
)  # fmt: skip


@numba.njit(cache=True)
def _slope(values: Array, step: float) -> Array:  # pragma: no cover
    """Rate of change, as `numpy.gradient` has it."""
    out = np.empty(len(values))
    out[0], out[-1] = (values[1] - values[0]) / step, (values[-1] - values[-2]) / step
    out[1:-1] = (values[2:] - values[:-2]) / (2.0 * step)
    return out


@numba.njit(cache=True)
def _features(speed: Array, effort: Array, tracking: Array, slow: float, step: float) -> Array:  # pragma: no cover
    """Features of one block, in the order of `FEATURES`; NaN for those whose kind of motion it lacks."""
    found = np.full(14, np.nan)
    slewing, rest = np.abs(speed) > 3.0 * slow, np.abs(speed) < slow
    tracked = np.isfinite(tracking).all()
    found[3] = np.quantile(np.abs(effort), 0.98)
    if slewing.mean() > 0.3:
        moving, way = effort[slewing], np.sign(speed[slewing])
        found[0] = np.mean(moving * way)
        found[1] = np.sqrt(np.mean(moving**2))
        found[2] = np.std(moving)
        found[6] = np.mean(moving)
        acceleration = _slope(speed, step)
        spread = np.std(acceleration) * np.std(effort)
        if spread > 0:
            found[7] = np.mean((acceleration - acceleration.mean()) * (effort - effort.mean())) / spread
        if tracked:
            found[8] = np.sqrt(np.mean(tracking[slewing] ** 2))
            found[9] = np.mean(tracking[slewing] * way)
            found[12] = np.std(_slope(tracking, step)[slewing])
    if rest.mean() > 0.5:
        found[4] = np.mean(effort[rest])
        found[5] = np.std(effort[rest])
        if tracked:
            found[11] = np.mean(tracking[rest])
    if tracked:
        half = len(tracking) // 2
        found[10] = np.quantile(np.abs(tracking), 0.98)
        found[13] = np.mean(tracking[half:]) - np.mean(tracking[:half])
    return found


SIZES = tuple(name for name in FEATURES if name.rpartition(" ")[2] == "peak" or " rms" in name or " spread" in name)
"""Features that cannot be negative; their logarithm is judged, since a quicker motion multiplies them."""


def _scaled(name: str, value: Array) -> Array:
    return np.log(np.maximum(value, 1e-300)) if name in SIZES else value


def learn(gathered: Sequence[Numbers], settings: Mapping[str, float]) -> dict[str, Array]:
    """Mean and spread of each feature over the fault-free batches; few lean on what another motion would do."""
    learnt = {}
    for name in FEATURES:
        whole = np.array([one[name][0] for one in gathered])
        whole = whole[np.isfinite(whole)]
        if len(whole) < 2:
            continue
        # A signed feature moves with the size of its channel, which its root mean square or its peak tells.
        peers = [one for one in SIZES if one.split()[0] == name.split()[0]]
        sizes = np.array([[one[peer][0] for peer in peers] for one in gathered])
        size = 1.0 if name in SIZES or not np.isfinite(sizes).any() else float(np.nanmedian(sizes))
        if name == "effort against acceleration":
            size = 1.0
        values, prior, dof = _scaled(name, whole), float(settings["prior_batches"]), len(whole) - 1
        usual = (settings["usual_share"] * size) ** 2
        variance = (dof * np.var(values, ddof=1) + prior * usual) / (dof + prior)
        spread = np.sqrt(variance * (1.0 + 1.0 / len(whole)))
        learnt[name] = np.array([values.mean(), spread, dof + prior, *_by_blocks([one[name] for one in gathered])])
    return learnt


def _by_blocks(medians: Sequence[Array]) -> tuple[float, float]:
    """Variance of a feature from block to block within a batch, and how many blocks a batch has."""
    scatter, count = np.array([one[3:] for one in medians]).T
    known = np.isfinite(scatter)
    return (float(scatter[known].mean()), float(count[known].mean())) if known.any() else (0.0, 1.0)


def _spread(usual: Array, count: float, own: float) -> float:
    """Spread of the median of so many blocks, which scatter by a variance of their `own`.

    The baseline's batches tell that of as many as they have; the median of fewer wanders more, by what the blocks of
    one batch scatter. So does that of a batch whose blocks scatter more than the baseline's: it moved otherwise, and
    its median is known no better than its own blocks agree on it.
    """
    own = own if np.isfinite(own) else 0.0
    spread, scatter, whole = (float(value) for value in (usual[1], *(usual[3:] if len(usual) > 3 else (own, 1.0))))
    fewer = max(_median_of(count) - _median_of(whole), 0.0)
    wilder = max(own - scatter, 0.0) * _median_of(count)
    return max(float(np.sqrt(spread**2 + scatter * fewer + wilder)), 1e-300)


def _median_of(count: float) -> float:
    """Variance of the median of so many normal values of variance one, to a few percent."""
    return 0.5 * np.pi / (max(count, 1.0) + 0.5 * np.pi - 1.0)


def look(numbers: Numbers, learnt: Numbers, rate: float, settings: Mapping[str, float]) -> Finding | None:
    """Hold every feature against the baseline; both halves of the batch must stand out, on the same side."""
    names = [name for name in FEATURES if name in learnt and name in numbers and np.isfinite(numbers[name][0])]
    if not names:
        return None
    scores = np.zeros(len(names))
    p_values = np.ones(len(names))
    for i, name in enumerate(names):
        mean, dof = learnt[name][0], learnt[name][2]
        own, count = (float(value) for value in numbers[name][3:])
        off = (_scaled(name, numbers[name][:3]) - mean) / _spread(learnt[name], count, own)
        halves = off[1:][np.isfinite(off[1:])]
        lasts = len(halves) == 0 or (np.sign(halves) == np.sign(off[0])).all()
        scores[i] = off[0] if not lasts else np.sign(off[0]) * min([abs(off[0]), *(1.5 * np.abs(halves))])
        p_values[i] = min(1.0, 2.0 * len(names) * student.beyond(abs(scores[i]) if lasts else 0.0, dof))
    i = int(np.argmin(p_values))
    dof = float(learnt[names[i]][2])
    limit = student.limit(rate / (2.0 * len(names)), dof)
    side = "above" if scores[i] > 0 else "below"
    shown = numbers["shown"]
    drawn = {name: shown[:, k + 1] for k, name in enumerate(SHOWN) if np.isfinite(shown[:, k + 1]).any()}
    return Finding(
        "signals", "signal", "", bool(p_values[i] < rate), float(p_values[i]), float(abs(scores[i])), limit,
        "deviations",
        f"{names[i]} is {abs(scores[i]):.1f} deviations {side} its baseline (limit {limit:.1f})", None,
        {"t": shown[:, 0], **drawn, "features": names, "scores": scores, "threshold": limit, "feature": names[i]},
    )  # fmt: skip


DETECTOR = Detector(
    name="signals",
    method="signal",
    needs=(),
    settings={"block_s": 5.0, "usual_share": 0.3, "prior_batches": 4.0},
    tally=_Tally,
    learn=learn,
    look=look,
    false_alarm_rate=0.1,
    source="NLR predictive maintenance concept, section 2 (signal analysis); Smyth 2004 (moderated variance)",
)
