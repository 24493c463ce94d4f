"""Efforts of a loop that nobody describes: held from sample to sample, or some of those that a faster loop made.

A log does not say which. Held, those of a faster loop act half a sample late, and a sound joint logged at 100 Hz in a
loop of 500 Hz was `unexplained`, or lacked a mode. The recordings tell, whatever else is missing, once the plainest
frictions are fitted beside the numbers of the plant: of sixteen joints in loops of 100 Hz to 1 kHz, sound or without
friction, cogging or stiffness, the ticks from sample to sample came out as 1, 2, 4 or 5, and 8 or 10, by 0.13 to 1.4 a
sample. Beside a play, which the observer does not know, held efforts were less likely by 0.06, and of 38 joints of the
proof whose efforts are held, two by less than 0.02, and then lacked a delay: they are held where little is gained. A
logged speed that lags is fitted beside the frictions, for it looks like efforts that run on, too. In one turn the fit
did not get there: of nine joints in loops of 100 to 500 Hz, rough or lagging or both, six came out right, all once it
goes on to the end, those of the faster loops by 0.16 to 0.24 a sample. And they are held in a log whose samples lie
unevenly, as no one number of ticks lies between them: run on by any, those of an arm's joint made its dry friction now
this term and now that.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from gsfdi.drive import course, regular
from gsfdi.model import JointModel, TermUse
from gsfdi.reconcile.bench import Bench, bench
from gsfdi.reconcile.hand import Round, settle, started, surprise_of
from gsfdi.reconcile.knobs import plant_knobs, start_knobs, term_knobs
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.thinned import calmed
from gsfdi.types import JointRecord

TICKS = (1, 2, 3, 4, 5, 8, 10, 20)
"""Ticks of a loop from one sample to the next that are tried; of many more, efforts act half a sample early."""
LEAST = 0.1
"""Log-likelihood per sample that efforts which run on must gain."""
LAGS = 0.1
"""Samples by which a logged speed lags as its fit begins."""


def unheld(stand: Bench, model: JointModel) -> list[JointRecord] | None:
    """Give records with the mean effort from each sample to the next; None where it is held.

    Parameters
    ----------
    stand : Bench
        With the records as they are.
    model : JointModel
        Without a controller, its effort's noise stated.
    """
    if any(regular(record.t) is record.t for record in stand.records):
        return None
    calm, costs = [calmed(record) for record in stand.records], dict[int, float]()
    for ticks in TICKS:
        if ticks > 3 and costs[3] > min(costs[1], costs[2]):
            break
        costs[ticks] = surprise_of(plainest(stand, [running_on(record, ticks) for record in calm], model))
    best = min(costs, key=lambda ticks: costs[ticks])
    samples = sum(len(record.t) for record in calm)
    return [running_on(record, best) for record in calm] if costs[1] - costs[best] > LEAST * samples else None


def running_on(record: JointRecord, ticks: int) -> JointRecord:
    """Give `record` with the mean of the efforts of `ticks` from each sample on."""
    if ticks == 1:
        return record
    t, effort = record.t, record[record.effort]
    step = np.diff(t, append=t[-1])
    mean = np.mean([course(t, effort, t + tick / ticks * step) for tick in range(ticks)], axis=0)
    channels = {**record.channels, record.effort: np.where(np.isfinite(mean), mean, effort)}
    return replace(record, channels=channels)


def plainest(stand: Bench, records: Sequence[JointRecord], model: JointModel) -> Round:
    """Fit the plant, the plainest frictions and a lag of the speed to a joint that the efforts of `records` drive."""
    size = 0.02 * stand.scales.torque
    terms = [
        TermUse("coulomb_friction", {"torque_nm": size}),
        TermUse("viscous_friction", {"coefficient_nms_rad": size / stand.scales.speed}),
        TermUse("quadratic_friction", {"coefficient_nms2_rad2": size / stand.scales.speed**2}),
    ]
    if stand.sees_speed:
        terms.append(TermUse("velocity_lag", {"lag_s": LAGS * stand.scales.period}))
    own = replace(bench(records, model), count=stand.count)
    full = replace(started(model, len(own.records)), physics=(*model.physics, *terms))
    knobs = [*plant_knobs(model, records[0].effort), *start_knobs(own)]
    knobs += [knob for place in range(len(model.physics), len(full.physics)) for knob in term_knobs(own, full, place)]
    return settle(own, full, knobs, effort_floor(own))
