"""The controller's law, recomputed from the log: whether the recorded effort is what the recorded errors ask for.

The law involves no mechanics. What it cannot account for lies in the controller's gains, in the effort's own sensor or
limit, or in the clock between effort and measurement, and is settled before any physics is blamed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from gsfdi.drive import measured_velocity
from gsfdi.model import Controller, JointModel
from gsfdi.types import Array, JointRecord, Mask

COARSE = 0.003
"""Share of the effort below which a misfit of the law is how it was sampled and held rather than what it is."""


@dataclass(frozen=True, slots=True)
class LawFinding:
    """Something that the law lacks: a term id, its values, its onset, and how likely the next best is.

    `share` is the part of the law's misfit that it explains; `spread` the standard deviation of its first value.
    """

    term: str
    values: Mapping[str, float]
    onset: float | None
    gain: float
    share: float
    spread: float


@dataclass(frozen=True, slots=True)
class LawCheck:
    """How the law held: misfit before and after [effort's unit], relative to the effort, and what was found."""

    before: float
    after: float
    effort: float
    noise: float
    findings: tuple[LawFinding, ...]
    derivative_delay: float = 0.0
    """Age of the speed that the controller must have had [s], where it is not logged."""

    @property
    def holds(self) -> bool:
        """Whether what is left is noise, or too small to matter."""
        return bool(self.after < max(1.5 * self.noise, 2 * COARSE * self.effort))


@dataclass(frozen=True, slots=True)
class Sheet:
    """One stretch laid out: effort and the parts of the law, sample by sample."""

    t: Array
    effort: Array
    parts: Mapping[str, Array]
    limited: Mask
    growth: Array
    rate: Array
    braking: Array
    """What the law takes off for the measured speed."""


def check_law(records: Sequence[JointRecord], model: JointModel, most: int = 2) -> LawCheck | None:
    """Hold the recorded effort against the model's controller; None where either is missing."""
    law = model.controller
    if law is None or not all("setpoint" in r for r in records):
        return None
    sheets = sheets_of(records, model, law)
    if (
        not sheets
        or law.sample_rate * np.median(np.diff(sheets[0].t)) < 0.5
        or law.sample_rate * np.median(np.diff(sheets[0].t)) > 1.5
    ):
        return None
    noise = float(np.hypot(model.sensors.effort_noise, model.sensors.effort_resolution / np.sqrt(12)))
    measured = all(np.isfinite(measured_velocity(r, model)).any() for r in records)
    if not measured and law.derivative_delay == 0.0 and (age := speed_age(records, model)) > 0:
        law = replace(law, derivative_delay=age)
        sheets = sheets_of(records, model, law)
    noise = noise if noise > 0 and measured else max(noise, _hiss(sheets))
    size = float(np.sqrt(np.mean(np.concatenate([s.effort for s in sheets]) ** 2)))
    before = left = _left(sheets, [])
    findings: list[LawFinding] = []
    while len(findings) < most:
        trials = _hypotheses(records, model, law, sheets, findings, measured)
        trials = [f for f in trials if f.gain > SURE and _matters(f, size, law) and (measured or _plain(f))]
        trials = [
            f for f in trials if f.share > 0.5 or (f.share > 0.05 and left**2 * (1 - f.share) < (1.3 * noise) ** 2)
        ]
        best = max(trials, key=lambda f: f.gain, default=None)
        if best is None:
            break
        findings.append(best)
        late = sum(f.values.get("delay_s", 0.0) for f in findings)
        sheets = sheets_of(records, model, law, late)
        left = _left(sheets, findings)
    return LawCheck(before, left, size, noise, tuple(findings), law.derivative_delay)


BETWEEN = 0.03
"""Standard deviation, in ticks, of what reading between samples costs a delay."""
SURE = 25.0
"""Log-likelihood that a finding must gain."""
AGES = (0.0, 0.5, 1.0, 1.5, 2.0)
"""Ages of a speed that is taken from differences of positions, in ticks."""


def speed_age(records: Sequence[JointRecord], model: JointModel) -> float:
    """Find the age of the speed [s] under which the law holds far better than under the speed of the moment, or 0."""
    law = model.controller
    assert law is not None

    def left(ticks: float) -> float:
        aged = replace(law, derivative_delay=ticks / law.sample_rate)
        return _left(sheets_of(records, model, aged), [])

    misfits = {ticks: left(ticks) for ticks in AGES}
    best = min(misfits, key=lambda ticks: misfits[ticks])
    return best / law.sample_rate if misfits[best] < 0.5 * misfits[0.0] else 0.0


def _matters(finding: LawFinding, size: float, law: Controller) -> bool:
    """Whether a finding is larger than what sampling and holding may differ by."""
    values = finding.values
    if "ratio" in values:
        return abs(values["ratio"] - 1) > max(COARSE, 4 * finding.spread)
    if "delay_s" in values:
        return values["delay_s"] * law.sample_rate > 0.02
    return abs(values.get("bias_a", np.inf)) > COARSE * size


def _plain(finding: LawFinding) -> bool:
    """Whether a finding is plain enough to be believed with a speed that was differentiated from positions."""
    return finding.term != "controller_derivative" and (finding.share > 0.5 or finding.term == "current_limit")


def sheets_of(records: Sequence[JointRecord], model: JointModel, law: Controller, late: float = 0.0) -> list[Sheet]:
    """Lay out every stretch that can be."""
    return [sheet for r in records if (sheet := sheet_of(r, model, law, late)) is not None]


def sheet_of(record: JointRecord, model: JointModel, law: Controller, late: float) -> Sheet | None:
    """Lay out a stretch whose measurements are stamped `late` [s] too late."""
    t = record.t
    position, velocity = record["position"], measured_velocity(record, model)
    if model.structure == "flexible":
        velocity = velocity / model.plant.gear_ratio
    if not np.isfinite(velocity).any():
        velocity = np.gradient(position, t)
    good = np.isfinite(position) & np.isfinite(velocity)
    if good.sum() < 50:
        return None
    position = np.interp(t + late, t[good], position[good])
    velocity = np.interp(t + late - law.derivative_delay, t[good], velocity[good])
    rate = record["setpoint_rate"] if "setpoint_rate" in record else np.gradient(record["setpoint"], t)
    ahead = np.nan_to_num(record[f"{record.effort}_feedforward"]) if f"{record.effort}_feedforward" in record else 0 * t
    error = record["setpoint"] - position
    growth = np.concatenate([[0.0], 0.5 * (error[1:] + error[:-1]) * np.diff(t)]) * law.integral
    parts = {
        "proportional": law.proportional * error,
        "integral": np.nancumsum(growth),
        "derivative": law.derivative * (law.rate_feedforward * rate - velocity),
        "feedforward": ahead,
    }
    effort = record[record.effort]
    keep = np.isfinite(effort) & good & np.isfinite(error) & np.isfinite(rate) & (t + late <= t[-1])
    parts = {name: values[keep] for name, values in parts.items()}
    limited = np.abs(effort[keep]) >= 0.999 * law.limit
    braking = -law.derivative * velocity[keep]
    return Sheet(t[keep], effort[keep], parts, limited, np.nan_to_num(growth[keep]), rate[keep], braking)


def commanded(sheet: Sheet, findings: Sequence[LawFinding]) -> Array:
    """Effort that the law asks for, less a constant, once the findings are taken into account."""
    ratios = {
        f.term.removeprefix("controller_"): f.values["ratio"] for f in findings if f.term.startswith("controller_")
    }
    parts = dict(sheet.parts)
    limit = next((f.values["limit_a"] for f in findings if f.term == "current_limit"), None)
    if limit is not None:
        parts["integral"] = _waiting(sheet, limit)
    total = np.sum([ratios.get(name, 1.0) * part for name, part in parts.items()], axis=0)
    for finding in findings:
        if finding.term == "current_gain":
            total = total * finding.values["ratio"]
        elif finding.term == "current_bias":
            total = total + finding.values["bias_a"] * (sheet.t >= (finding.onset or 0.0))
        elif finding.term == "position_gain":  # the log's speed is the slope of its positions; the controller's is not
            total = total + (1 / finding.values["ratio"] - 1) * sheet.braking
    return np.asarray(total)


def _waiting(sheet: Sheet, limit: float) -> Array:
    """Integral part that waits while more than `limit` is asked for."""
    asked = np.asarray(np.sum([part for name, part in sheet.parts.items() if name != "integral"], axis=0))
    free = np.abs(sheet.effort) < 0.98 * limit
    first = int(np.argmin(free)) if not free.all() else len(free)
    if first < 20:  # where the integral began cannot be told: it waits wherever the effort is at the limit
        return np.cumsum(np.where(np.abs(sheet.effort) < 0.99 * limit, sheet.growth, 0.0))
    start = float(np.mean((sheet.effort - asked - np.cumsum(sheet.growth))[:first]))
    found, integral = np.empty(len(asked)), start
    for k, (rest, growth) in enumerate(zip(asked.tolist(), sheet.growth.tolist(), strict=True)):
        if abs(rest + integral + growth) <= limit:
            integral += growth
        found[k] = integral
    return found


def _misfits(sheets: Sequence[Sheet], findings: Sequence[LawFinding]) -> list[Array]:
    """Recorded effort less the law's, the free constant of the integral taken out of every stretch."""
    found = []
    limit = next((f.values["limit_a"] for f in findings if f.term == "current_limit"), np.inf)
    for sheet in sheets:
        off = sheet.effort - commanded(sheet, findings)
        free = ~sheet.limited & (np.abs(sheet.effort) < 0.995 * limit)
        off = np.where(free, off, 0.0)
        found.append(np.where(free, off - _level(off, free), 0.0))
    return found


def level_of(sheet: Sheet, findings: Sequence[LawFinding]) -> float:
    """Constant that the law's integral began with."""
    limit = next((f.values["limit_a"] for f in findings if f.term == "current_limit"), np.inf)
    return _level(sheet.effort - commanded(sheet, findings), ~sheet.limited & (np.abs(sheet.effort) < 0.995 * limit))


def _level(off: Array, free: Mask) -> float:
    return float(np.mean(off[free])) if free.any() else 0.0


def _left(sheets: Sequence[Sheet], findings: Sequence[LawFinding]) -> float:
    """Root mean square of what the law leaves."""
    return float(np.sqrt(np.mean(np.concatenate(_misfits(sheets, findings)) ** 2)))


def _hiss(sheets: Sequence[Sheet]) -> float:
    """White noise of the effort, from its third differences."""
    third = np.concatenate([np.diff(s.effort - commanded(s, []), 3) for s in sheets])
    return float(1.4826 * np.median(np.abs(third)) / 20.0**0.5)


def _hypotheses(
    records: Sequence[JointRecord],
    model: JointModel,
    law: Controller,
    sheets: Sequence[Sheet],
    so_far: Sequence[LawFinding],
    measured: bool,
) -> list[LawFinding]:
    """Everything that the law could lack, with what each would gain; `measured` says whether the speed is logged."""
    misfits = _misfits(sheets, so_far)
    n = sum(len(m) for m in misfits)
    energy = float(sum(m @ m for m in misfits))
    taken = {f.term for f in so_far}

    def gain(rest: float) -> float:
        return 0.5 * n * float(np.log(energy / max(rest, 1e-12 * energy)))

    found = []
    columns: dict[str, list[Array]] = {
        f"controller_{name}": [s.parts[name] for s in sheets] for name in ("proportional", "integral", "derivative")
    }
    columns["current_gain"] = [commanded(s, so_far) for s in sheets]
    if not measured:  # positions on a wrong scale: the controller had the speed itself, the log has their slope
        columns["position_gain"] = [s.braking for s in sheets]
    for term, parts in columns.items():
        if term in taken:
            continue
        bare = [p - p.mean() for p in parts]
        info = float(sum(b @ b for b in bare))
        if info <= 0:
            continue
        slope = float(sum(b @ m for b, m in zip(bare, misfits, strict=True))) / info
        rest = energy - slope**2 * info
        ratio = 1 / (1 + slope) if term == "position_gain" else 1 + slope
        found.append(
            LawFinding(term, {"ratio": ratio}, None, gain(rest), 1 - rest / energy, float(np.sqrt(rest / n / info)))
        )
    if not taken & {"current_bias", "current_limit"} and len(sheets) == 1:
        found += _step(sheets[0], misfits[0], energy, gain)
    if "timestamp_latency" not in taken:
        found += _late(records, model, law, so_far, energy, n)
    if "current_limit" not in taken:
        found += _limit(sheets, so_far, energy, n)
    return found


def _step(sheet: Sheet, misfit: Array, energy: float, gain: object) -> list[LawFinding]:
    """A bias of the effort's sensor that sets in."""
    total = np.cumsum(misfit)
    n = len(misfit)
    k = np.arange(20, n - 20)
    if len(k) == 0:
        return []
    after, before = (total[-1] - total[k]) / (n - 1 - k), total[k] / (k + 1)
    size = after - before
    info = (k + 1) * (n - 1 - k) / n
    best = int(np.argmax(size**2 * info))
    rest = energy - float(size[best] ** 2 * info[best])
    spread = float(np.sqrt(rest / n / info[best]))
    value = gain(rest) - np.log(n)  # type: ignore[operator]
    return [
        LawFinding(
            "current_bias", {"bias_a": float(size[best])}, float(sheet.t[k[best] + 1]), value, 1 - rest / energy, spread
        )
    ]


def _late(
    records: Sequence[JointRecord],
    model: JointModel,
    law: Controller,
    so_far: Sequence[LawFinding],
    energy: float,
    n: int,
) -> list[LawFinding]:
    """Measurements that were stamped late: the law holds between effort and what will be logged a little later."""
    period = 1.0 / law.sample_rate

    def rest(late: float) -> float:
        return float(sum(m @ m for m in _misfits(sheets_of(records, model, law, late), so_far)))

    grid = np.array([0.25, 0.5, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0]) * period
    best = min(grid, key=rest)
    for width in (0.5, 0.15, 0.05, 0.015):
        best = min(
            (best + step * width * period for step in (-2, -1, 0, 1, 2) if best + step * width * period > 0), key=rest
        )
    least = rest(best)
    bend = (rest(best * 1.05) + rest(best * 0.95) - 2 * least) / (0.05 * best) ** 2
    spread = float(np.hypot(np.sqrt(2 * least / n / bend), BETWEEN * period)) if bend > 0 else best
    return [
        LawFinding(
            "timestamp_latency",
            {"delay_s": float(best)},
            None,
            0.5 * n * float(np.log(energy / least)) - 3,
            1 - least / energy,
            spread,
        )
    ]


def _limit(sheets: Sequence[Sheet], so_far: Sequence[LawFinding], energy: float, n: int) -> list[LawFinding]:
    """A limit that the drive keeps although the law asks for more."""
    effort = np.concatenate([s.effort for s in sheets])
    top = float(np.sort(np.abs(effort))[-3])
    found = []
    for depth in (0.998, 0.995, 0.98, 0.95):
        near = np.abs(effort) > depth * top
        limit = float(np.median(np.abs(effort[near])))
        trial = LawFinding("current_limit", {"limit_a": limit}, None, 0.0, 0.0, 0.0)
        misfits = _misfits(sheets, [*so_far, trial])
        rest = float(sum(m @ m for m in misfits)) * n / max(n - near.sum(), 1)
        asked = np.concatenate([commanded(s, [*so_far, trial]) for s in sheets])
        free = ~near
        asked = asked + float(np.median((effort - asked)[free]))
        if near.sum() < 3 or np.mean(np.abs(asked[near]) > limit) < 0.3:
            continue
        over = np.abs(asked) > limit  # noise lifts the highest efforts above the limit, not those asked to be higher
        limit = float(np.mean(np.abs(effort[over]))) if over.sum() > 10 else limit
        spread = float(np.std(np.abs(effort[near])) / np.sqrt(near.sum()))
        gained = 0.5 * n * float(np.log(energy / max(rest, 1e-12 * energy))) + 2.0
        found.append(LawFinding("current_limit", {"limit_a": limit}, None, gained, 1 - rest / energy, spread))
    return found
