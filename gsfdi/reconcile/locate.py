"""Where the mismatch lives: signals, conditions, times and frequencies, with the share of it that lies in each."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from gsfdi.channels import CHANNELS
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.contest import Contest
from gsfdi.reconcile.contract import Settled
from gsfdi.reconcile.remainder import missing_torque
from gsfdi.registry import shelf
from gsfdi.types import Array

BINS = 12


@dataclass(frozen=True, slots=True)
class Place:
    """A span of a covariate, the share of the misfit in it, and the share of time that the joint spent there."""

    covariate: str
    low: float
    high: float
    share: float
    time: float


def covariates(stand: Bench) -> list[dict[str, Array]]:
    """What the misfit may depend on, by record; names are columns where one measures it."""
    found = []
    axis = stand.model.axis
    width = max(1, round(0.05 / stand.scales.period))
    for record in stand.records:
        position = _bridged(record["position"])
        speed = np.gradient(
            np.convolve(np.pad(position, width, mode="edge"), np.ones(2 * width + 1) / (2 * width + 1), "valid"),
            record.t,
        )
        turns = stand.scales.turns
        slow = 0.02 * stand.scales.speed
        way = _held_sign(speed, slow)
        marks = np.flatnonzero(np.diff(way) != 0) + 1
        since = (
            record.t
            - np.concatenate([[record.t[0]], record.t[marks]])[
                np.searchsorted(marks, np.arange(len(way)), side="right")
            ]
        )
        names = {
            "motor_velocity": turns * speed,
            "position": position,
            record.effort: _bridged(record[record.effort]),
        }
        rows = {CHANNELS[name].column(axis): values for name, values in names.items()}
        rows["motor_angle_rad"] = np.mod(turns * position, 2 * np.pi)
        rows["time_since_reversal_s"] = since
        if stand.scales.warms and "temperature" in record:
            rows["temperature_c"] = record["temperature"]
        found.append(rows)
    return found


def _bridged(values: Array) -> Array:
    good = np.isfinite(values)
    rows = np.arange(len(values))
    return np.asarray(np.interp(rows, rows[good], values[good])) if good.any() else np.zeros(len(values))


def _held_sign(speed: Array, slow: float) -> Array:
    """Sign of the speed, kept from before while it is slow."""
    sign = np.where(np.abs(speed) > slow, np.sign(speed), 0.0)
    last = np.maximum.accumulate(np.where(sign != 0, np.arange(len(sign)), 0))
    return np.asarray(sign[last])


def places(stand: Bench, torque: Sequence[Array], most: int = 3) -> list[Place]:
    """Spans of conditions that hold much more of the misfit than of the time, the most telling first."""
    energy = np.concatenate(torque) ** 2
    total = float(energy.sum())
    rows = covariates(stand)
    if total <= 0:
        return []
    found: list[tuple[float, Place]] = []
    for name in rows[0]:
        values = np.concatenate([row[name] for row in rows])
        edges = np.unique(np.quantile(values, np.linspace(0, 1, BINS + 1)))
        if len(edges) < 4:
            continue
        bin_of = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, len(edges) - 2)
        share = np.bincount(bin_of, energy, len(edges) - 1) / total
        time = np.bincount(bin_of, minlength=len(edges) - 1) / len(values)
        low, high = _densest(share, time)
        inside, spent = float(share[low:high].sum()), float(time[low:high].sum())
        telling = inside * np.log(max(inside, 1e-9) / spent) + (1 - inside) * np.log(
            max(1 - inside, 1e-9) / max(1 - spent, 1e-9)
        )
        found.append((float(telling), Place(name, float(edges[low]), float(edges[high]), inside, spent)))
    found.sort(key=lambda pair: -pair[0])
    return [place for telling, place in found[:most] if telling > 0.02] or [place for _, place in found[:1]]


def _densest(share: Array, time: Array) -> tuple[int, int]:
    """Run of bins in which the misfit's share differs most tellingly from the time's."""
    best, ends = -1.0, (0, len(share))
    for low in range(len(share)):
        for high in range(low + 1, len(share) + 1):
            a, b = share[low:high].sum(), time[low:high].sum()
            if b >= 1 or a <= b:
                continue
            value = a * np.log(a / b) + (1 - a) * np.log(max(1 - a, 1e-9) / (1 - b))
            if value > best:
                best, ends = float(value), (low, high)
    return ends


def moments(stand: Bench, torque: Sequence[Array]) -> list[tuple[float, float]]:
    """Span of time that holds the misfit: from where its power first rises for good, to the end."""
    energy = np.concatenate(torque) ** 2
    t = np.concatenate([r.t for r in stand.records])
    if stand.count > 1 or energy.sum() <= 0:
        return [(float(t[0]), float(t[-1]))]
    order = np.argsort(t, kind="stable")
    total = np.cumsum(energy[order])
    n = len(total)
    k = np.arange(n // 20, n - n // 20, max(1, n // 500))
    before, after = total[k] / k, (total[-1] - total[k]) / (n - k)
    gain = k * np.log(before + 1e-300) + (n - k) * np.log(after + 1e-300)
    best = int(np.argmin(gain))
    if after[best] < 5 * before[best]:
        return [(float(t.min()), float(t.max()))]
    return [(float(t[order][k[best]]), float(t.max()))]


def bands(stand: Bench, torque: Sequence[Array], share: float = 0.8) -> list[tuple[float, float]]:
    """Band of frequencies [Hz] that holds `share` of the misfit."""
    rate = 1.0 / stand.scales.period
    power = np.zeros(513)
    for values in torque:
        for start in range(0, max(1, len(values) - 1023), 512):
            piece = values[start : start + 1024]
            power += np.abs(np.fft.rfft(piece * np.hanning(len(piece)), 1024)) ** 2
    total = np.cumsum(power) / max(power.sum(), 1e-300)
    low, high = np.searchsorted(total, [(1 - share) / 2, 1 - (1 - share) / 2])
    step = rate / 1024
    return [(float(max(0, low - 1) * step), float((high + 1) * step))]


def shares(stand: Bench, before: Sequence[Array], after: Sequence[Array]) -> Mapping[str, float]:
    """Misfit before and after, in torque and as a share of the drive's."""
    size = stand.scales.torque
    a, b = (float(np.sqrt(np.mean(np.concatenate(x) ** 2))) for x in (before, after))
    return {"before_nm": a, "after_nm": b, "before_share_of_drive": a / size, "after_share_of_drive": b / size}


def torque_of(stand: Bench, innovations: Sequence[Array], side: int = 0) -> list[Array]:
    """Missing torque by record, without its first moments."""
    wait = round(0.5 / stand.scales.period)
    found = []
    for values in missing_torque(stand, innovations, side):
        values = values.copy()
        values[:wait] = 0.0
        found.append(values)
    return found


def component_of(contests: Sequence[Contest], settled: Settled) -> str | None:
    """Component of an unnamed mismatch: the controller's where its law fails, else that of the nearest offers."""
    if settled.law is not None and not settled.law.holds:
        return "controller"
    terms = shelf("gsfdi.terms", PhysicsTerm)
    weights: dict[str, float] = {}
    for entry in contests[0].entries[:12]:
        gain = entry.gain if np.isfinite(entry.gain) else entry.linear
        component = terms[entry.offer.term].component
        weights[component] = max(weights.get(component, 0.0), gain)
    return max(weights, key=lambda name: weights[name]) if weights else None


def signals_of(component: str | None, stand: Bench, term: str | None = None) -> list[str]:
    """Columns in which a mismatch of this component, or of this sensor's term, shows first."""
    axis = stand.model.axis
    effort = CHANNELS[stand.records[0].effort].column(axis)
    position = CHANNELS["position"].column(axis)
    speed = CHANNELS["motor_velocity"].column(axis)
    if component == "sensor":
        own = {"current": [effort], "position": [position], "velocity": [speed], "encoder": [position]}
        every = [position, speed] if stand.sees_speed else [position]
        return own.get((term or "").partition("_")[0], every)
    if component in ("gearbox", "link"):
        return [effort, position]
    return [effort]


def location(
    stand: Bench, torque: Sequence[Array], component: str | None, term: str | None, begins: float | None = None
) -> dict[str, Any]:
    """Lay out where, when and in which frequencies a mismatch of a component lives, from when on if that is known."""
    when = [(float(begins), float(stand.scales.seconds))] if begins is not None else moments(stand, torque)
    return {
        "component": component,
        "signals": signals_of(component, stand, term),
        "where": [
            {
                "covariate": p.covariate,
                "low": p.low,
                "high": p.high,
                "share_of_misfit": p.share,
                "share_of_time": p.time,
            }
            for p in places(stand, torque)
        ],
        "when": [{"from_s": a, "to_s": b} for a, b in when],
        "bands_hz": [list(band) for band in bands(stand, torque)],
    }
