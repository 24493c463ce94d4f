"""A controller's law laid out over a recording: what each of its parts asks for, sample by sample."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal

import numba
import numpy as np

from gsfdi.model import Controller, JointModel
from gsfdi.packed import values_of
from gsfdi.reconcile.course import Course, course_of
from gsfdi.types import Array, JointRecord, Mask

PLAINLY = 0.9
"""Share of a limit up to which an effort is below it whatever its noise."""
NEARLY = 0.995
"""Share of a limit from which an effort is at it."""
BESIDE = 2
"""Samples beside one at the limit that are not held against the law either."""
Windup = Literal["goes_on", "rests", "unwinds"]
"""What an integral does at a limit: goes on as if there were none, rests, or takes on only what leads away from it."""
OWN: Windup = "unwinds"
"""What that of gsfdi's own controller does."""
BEGUN = 20
"""Samples of a stretch below a limit that tell where the integral began."""


@dataclass(frozen=True, slots=True)
class LawFinding:
    """Something that the law lacks: a term id, its values, its onset, and how likely the next best is.

    `share` is the part of the law's misfit that it explains; `spread` the standard deviation of its first value;
    `windup` what the integral does at a limit; `probability` its own beside whatever else the law was seen to lack.
    """

    term: str
    values: Mapping[str, float]
    onset: float | None
    gain: float
    share: float
    spread: float
    windup: Windup = "rests"
    probability: float = 1.0


def likeliest(found: Sequence[LawFinding]) -> LawFinding:
    """The finding that gains most, with its probability beside those of other terms, all equally likely before."""
    best = max(found, key=lambda f: f.gain)
    others = sum(float(np.exp(f.gain - best.gain)) for f in found if f.term != best.term)
    return replace(best, probability=1.0 / (1.0 + others))


def joined(findings: Sequence[LawFinding], new: LawFinding) -> tuple[LawFinding, ...]:
    """Add a finding to those before it; one of the same term makes that more exact."""
    for place, old in enumerate(findings):
        if old.term == new.term:
            values = {
                name: old.values[name] * value if name == "ratio" else old.values[name] + value
                for name, value in new.values.items()
            }
            return (*findings[:place], replace(old, values=values, spread=new.spread), *findings[place + 1 :])
    return (*findings, new)


@dataclass(frozen=True)
class Sheet:
    """One stretch laid out: effort and the parts of the law, sample by sample."""

    t: Array
    effort: Array
    parts: Mapping[str, Array]
    unheld: Mask
    """Samples that cannot be held against the law: at its limit, or with a rate of setpoint that nobody logged."""
    growth: Array
    rate: Array
    braking: Array
    """What the law takes off for the measured speed."""
    limit: float
    """The most effort that the law asks for, or the model's drive gives."""
    windup: Windup
    """What the integral does there."""

    @cached_property
    def size(self) -> Array:
        """Of the effort."""
        return np.abs(self.effort)

    @cached_property
    def peak(self) -> float:
        """Largest effort."""
        return float(np.max(self.size, initial=0.0))

    @cached_property
    def at_once(self) -> Array:
        """What all but the integral asks for."""
        return np.asarray(sum(part for name, part in self.parts.items() if name != "integral"))


@dataclass(frozen=True)
class Log:
    """What a law is held against.

    Parameters
    ----------
    records : sequence of JointRecord
    model : JointModel
    beyond : sequence of (n,) arrays, optional
        By record, what the motor's speed has beyond the slope of the positions [rad/s], where no speed is logged.
    """

    records: Sequence[JointRecord]
    model: JointModel
    beyond: Sequence[Array] | None = None

    @cached_property
    def courses(self) -> list[Course]:
        """What every stretch shows that can be laid out."""
        beyond: Sequence[Array | float] = self.beyond or [0.0] * len(self.records)
        found = (course_of(r, self.model, b) for r, b in zip(self.records, beyond, strict=True))
        return [course for course in found if course is not None]

    def sheets(self, law: Controller, late: float = 0.0) -> list[Sheet]:
        """Lay out every stretch, its measurements stamped `late` [s] too late."""
        return [laid_out(course, self.model, law, late) for course in self.courses]


def sheet_of(record: JointRecord, model: JointModel, law: Controller) -> Sheet | None:
    """Lay out one stretch; None where too little of it is logged."""
    course = course_of(record, model)
    return None if course is None else laid_out(course, model, law)


def laid_out(course: Course, model: JointModel, law: Controller, late: float = 0.0) -> Sheet:
    """Lay out a stretch whose measurements are stamped `late` [s] too late."""
    record, good = course.record, course.good
    t, effort = record.t, record[record.effort]
    position, velocity = course.position(t + late), course.velocity_at(t + late, law.derivative_delay)
    error = record["setpoint"] - position
    error[~good] = np.interp(t[~good], t[good], error[good])  # a lost row's setpoint is on a line, its position is not
    growth = np.concatenate([[0.0], 0.5 * (error[1:] + error[:-1]) * np.diff(t)]) * law.integral
    parts = {
        "proportional": law.at_once * error,
        "integral": np.nancumsum(growth),
        "derivative": law.derivative * (law.rate_feedforward * course.rate - velocity),
        "feedforward": course.ahead,
    }
    keep = np.isfinite(effort) & good & np.isfinite(error) & np.isfinite(course.rate) & (t + late <= t[-1])
    parts = {name: values[keep] for name, values in parts.items()}
    unheld = (np.abs(effort) >= 0.999 * law.limit)[keep] | course.unrated[keep]
    braking = -law.derivative * velocity[keep]
    growth = np.diff(parts["integral"], prepend=0.0)  # from row to row that is kept, over those that are not
    drive = min((values_of(use)[0] for use in model.physics if use.term == "current_limit"), default=np.inf)
    limit = min(law.limit, drive)
    own = law.limit <= drive
    windup = OWN if own else "goes_on"
    sheet = Sheet(t[keep], effort[keep], parts, unheld, growth, course.rate[keep], braking, limit, windup)
    return at_rest(sheet) if own and limit_of(sheet, ()) is not None else sheet


def unit_sheets(records: Sequence[JointRecord], model: JointModel) -> tuple[Controller, list[Sheet]] | None:
    """Lay out every record by a law of gains of 1 at its own rate; None where one has no setpoint or cannot be."""
    if not all("setpoint" in record for record in records):
        return None
    unit = Controller(1.0, 1.0, 1.0, float(1.0 / np.median(np.diff(records[0].t))))
    sheets = Log(records, model).sheets(unit)
    return (unit, sheets) if len(sheets) == len(records) else None


def younger(law: Controller, lag: float) -> Controller:
    """Give the law as it reads beside a logged speed that lags behind the one it was fed."""
    return replace(law, derivative_delay=law.derivative_delay - lag)


def hiss(stretches: Sequence[Array]) -> float:
    """Standard deviation of white noise in values, from their third differences."""
    third = np.concatenate([np.diff(values, 3) for values in stretches])
    return float(1.4826 * np.median(np.abs(third)) / 20.0**0.5)


def commanded(sheet: Sheet, findings: Sequence[LawFinding]) -> Array:
    """Effort that the law asks for, less a constant, once the findings are taken into account."""
    ratios = {
        f.term.removeprefix("controller_"): f.values["ratio"] for f in findings if f.term.startswith("controller_")
    }
    parts = dict(sheet.parts)
    limit = limit_of(sheet, findings)
    if limit is not None and limit[1] != "goes_on":
        parts["integral"] = waiting(sheet, *limit)
    total = np.asarray(sum(ratios.get(name, 1.0) * part for name, part in parts.items()))
    for finding in findings:
        if finding.term == "current_gain":
            total = total * finding.values["ratio"]
        elif finding.term == "current_bias":
            total = total + finding.values["bias_a"] * (sheet.t >= (finding.onset or 0.0))
        elif finding.term == "position_gain":  # the log's speed is the slope of its positions; the controller's is not
            total = total + (1 / finding.values["ratio"] - 1) * sheet.braking
    return total


def limit_of(sheet: Sheet, findings: Sequence[LawFinding]) -> tuple[float, Windup] | None:
    """Least limit of the effort, known where it is met or found, and what the integral does at it."""
    met = sheet.peak > PLAINLY * sheet.limit
    known = [(sheet.limit, sheet.windup)] if met else []
    found = [(f.values["limit_a"], f.windup) for f in findings if f.term == "current_limit"]
    return min([*known, *found], default=None)


def at_rest(sheet: Sheet) -> Sheet:
    """The sheet by the likelier rule of how the integral waits at the law's own limit, of which no model says which."""
    rules: tuple[Windup, ...] = (OWN, "rests")
    return min(
        (replace(sheet, windup=rule) for rule in rules), key=lambda one: float(np.sum(misfits([one], ())[0] ** 2))
    )


def waiting(sheet: Sheet, limit: float, windup: Windup) -> Array:
    """Integral part that waits while more than `limit` is asked for."""
    asked, free = sheet.at_once, sheet.size < 0.98 * limit
    first = int(np.argmin(free)) if not free.all() else len(free)
    if first < BEGUN:  # where the integral began cannot be told: it waits wherever the effort is at the limit
        return np.cumsum(np.where(sheet.size < 0.99 * limit, sheet.growth, 0.0))
    start = float(np.mean(sheet.effort[:first] - asked[:first] - np.cumsum(sheet.growth[:first])))
    found = np.empty(len(asked))
    _wait(asked, sheet.growth, start, limit, windup == "unwinds", found)
    return found


@numba.njit(cache=True)
def _wait(asked, growth, start, limit, unwinds, out):  # type: ignore[no-untyped-def]
    """Sum `growth` from `start` on but where that would ask for more than `limit` beside what else is `asked` for.

    An integral that `unwinds` takes on what lessens it.
    """
    integral = start
    for k in range(len(asked)):
        total = asked[k] + integral + growth[k]
        if abs(total) <= limit or (unwinds and total * growth[k] < 0.0):
            integral += growth[k]
        out[k] = integral


def misfits(sheets: Sequence[Sheet], findings: Sequence[LawFinding]) -> list[Array]:
    """Recorded effort less the law's, the free constant of the integral taken out of every stretch."""
    return [centred(*against(sheet, findings)) for sheet in sheets]


def against(sheet: Sheet, findings: Sequence[LawFinding]) -> tuple[Array, Mask]:
    """Hold the recorded effort against the law's.

    Returns
    -------
    (n,) array
        The difference, but for a constant.
    (n,) bool array
        Samples that count: below the limit that was found, and not beside one that is at it.
    """
    limit = limit_of(sheet, findings)
    off = sheet.effort - commanded(sheet, findings)
    if limit is None:
        return off, ~sheet.unheld
    asked = sheet.effort - off + level(off, ~sheet.unheld & (sheet.size < PLAINLY * limit[0]))
    met = np.maximum(sheet.size, np.abs(asked)) >= NEARLY * limit[0]  # noise makes some efforts look lower
    return off, ~(sheet.unheld | beside(met))


def beside(met: Mask) -> Mask:
    """Samples that are at a limit, or beside one that is."""
    held = met.copy()
    for by in range(1, BESIDE + 1):
        held[by:] |= met[:-by]
        held[:-by] |= met[by:]
    return held


def centred(values: Array, free: Mask) -> Array:
    """Give values less their mean over the free samples, 0 elsewhere."""
    return np.where(free, values - level(values, free), 0.0)


def level_of(sheet: Sheet, findings: Sequence[LawFinding]) -> float:
    """Constant that the law's integral began with."""
    return level(*against(sheet, findings))


def level(off: Array, free: Mask) -> float:
    """Mean over the free samples, 0 where there are none."""
    return float(np.mean(off[free])) if free.any() else 0.0


def columns_of(sheets: Sequence[Sheet], findings: Sequence[LawFinding]) -> dict[str, list[Array]]:
    """Columns of everything that scales a part of the law, or all of it, by term."""
    columns = {
        f"controller_{name}": [sheet.parts[name] for sheet in sheets]
        for name in ("proportional", "integral", "derivative")
    }
    columns["current_gain"] = [commanded(sheet, findings) for sheet in sheets]
    # positions on a wrong scale: the controller had the speed itself, the log has their slope
    columns["position_gain"] = [sheet.braking for sheet in sheets]
    return columns


def scaled(term: str, slope: float, gain: float, share: float, spread: float) -> LawFinding:
    """Give a column's coefficient as a finding."""
    ratio = 1 / (1 + slope) if term == "position_gain" else 1 + slope
    return LawFinding(term, {"ratio": ratio}, None, gain, share, spread)


@dataclass(frozen=True)
class Held:
    """A law held against its log, with what was found of it."""

    log: Log
    law: Controller
    findings: tuple[LawFinding, ...] = ()

    @property
    def late(self) -> float:
        """Time [s] by which measurements were found to be stamped late."""
        return sum(f.values.get("delay_s", 0.0) for f in self.findings)

    @property
    def aged(self) -> Controller:
        """The law with the age that its speed has beside the logged one, which may lag behind it."""
        return younger(self.law, sum(f.values.get("lag_s", 0.0) for f in self.findings))

    @cached_property
    def sheets(self) -> list[Sheet]:
        """Every stretch, laid out with its measurements where they belong."""
        return self.log.sheets(self.aged, self.late)

    @cached_property
    def _pairs(self) -> list[tuple[Array, Mask]]:
        """What the law leaves but for a constant, by stretch, and the samples that are held against it."""
        return [against(sheet, self.findings) for sheet in self.sheets]

    @cached_property
    def off(self) -> list[Array]:
        """Recorded effort less the law's, 0 where it is not held against it."""
        return [centred(*pair) for pair in self._pairs]

    @property
    def free(self) -> list[Mask]:
        """Samples, by stretch, that are held against the law."""
        return [free for _, free in self._pairs]

    @property
    def shown(self) -> list[Array]:
        """What the law leaves, by stretch, of the samples that are held against it."""
        return [off[free] for off, free in zip(self.off, self.free, strict=True)]

    @property
    def energy(self) -> float:
        """Sum of the squares of what the law leaves."""
        return float(sum(m @ m for m in self.off))

    @cached_property
    def samples(self) -> int:
        """Samples over all stretches that are held against the law.

        With those that are not, a third of a recording that had lost rows, 2.0e-4 A of noise seemed to be 1.6e-4.
        """
        return sum(map(len, self.shown))

    @property
    def left(self) -> float:
        """Root mean square of what the law leaves."""
        return float(np.sqrt(self.energy / max(self.samples, 1)))

    @property
    def hiss(self) -> float:
        """White noise of the effort."""
        return hiss([s.effort - commanded(s, []) for s in self.sheets])

    def gain(self, rest: float) -> float:
        """Log-likelihood gained where the misfit's energy falls to `rest`."""
        return 0.5 * self.samples * float(np.log(self.energy / max(rest, 1e-12 * self.energy)))
