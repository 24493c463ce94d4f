"""What the fitted model itself would leave: the same motion simulated, with its sensors' noise, on a bench of its own.

A joint that sticks and slips, seen by its position alone, leaves more than the noise of its effort although nothing is
missing: the observer, shaken by the sensors, breaks away at other moments. And where no speed is logged and no law
tells it (see `told`), so that the effort is only known with its sensor's noise, feedback makes that noise look like
losses in the gearbox; where the law does, that noise is in the speed. Only twins tell how much of either is usual. Of
300 sound joints whose friction turns smoothly nine had a name, and one has.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gsfdi.errors import UnusableInputError
from gsfdi.model import JointModel, Plant
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.clean import rough_law
from gsfdi.reconcile.compete import opening, rewritten
from gsfdi.reconcile.contest import contend
from gsfdi.reconcile.contract import Settled, settle_contract
from gsfdi.reconcile.finalists import CHANCE, PLAIN
from gsfdi.reconcile.hand import Round
from gsfdi.reconcile.noise import effort_floor
from gsfdi.simulate import simulate_record

SEED = 1
TWINS = 4
"""Twins by which the usual gain of a term that is not there is told."""


def left_by_twin(stand: Bench, own: JointModel, settled: Settled) -> float:
    """Torque noise that a twin leaves, as a share of the drive's torque; 0 where it cannot be simulated.

    Parameters
    ----------
    stand : Bench
        With the recordings whose motion it repeats.
    own : JointModel
        What it is simulated from, with sensors as the log shows them.
    settled : Settled
    """
    own = settled.as_logged(own)
    twin = twin_of(stand, own, own)
    return 0.0 if twin is None else float(np.linalg.norm(twin.torque)) / stand.scales.torque


def is_feigned(gained: float, first: Round, settled: Settled, plant: Plant, gain_of: Callable[[Round], float]) -> bool:
    """Whether a faint gain is no more than twins of the nominal model show, its terms written as suits the recordings.

    Only where the effort's noise acts on what is seen of the motion, for no speed is logged.

    Parameters
    ----------
    gained : float
        Log-likelihood by which something that the nominal model has not got suits the recordings better.
    first : Round
        Parameters only.
    settled : Settled
    plant : Plant
        Parameters of the twins.
    gain_of : callable
        What a twin that is held against the nominal model gains by the same.
    """
    if gained > PLAIN or settled.level > 0 or first.stand.sees_speed:
        return False
    nominal = settled.as_logged(settled.model)
    given = len(nominal.physics)
    physics = rewritten(first, given, effort_floor(first.stand)).fitted.model.physics[:given]
    own, gains = replace(nominal, plant=plant, physics=physics), []
    for seed in range(SEED, SEED + TWINS):
        twin = twin_of(first.stand, own, nominal, seed)
        if twin is None:
            return False
        gains.append(gain_of(twin))
    usual = float(np.mean(np.maximum(gains, 0.0)))  # of a gain that falls off exponentially
    return gained < usual * float(np.log(1.0 / CHANCE))


def gain_of_term(twin: Round, term: PhysicsTerm) -> float:
    """Log-likelihood that a term gains on a twin without it, once the model's own terms are so written as suits it.

    Contests are won beside those. A friction that turned round smoothly, and in the model at once, gained 395 to 457 on
    twins by a bump, which in the recording had gained 49 beside the friction as it was.
    """
    given, floor = len(twin.fitted.model.physics), effort_floor(twin.stand)
    contest, _ = contend(rewritten(twin, given, floor), {term.name: term}, floor, given)
    return max((entry.gain for entry in contest.entries if entry.fitted is not None), default=0.0)


def twin_of(stand: Bench, own: JointModel, nominal: JointModel, seed: int = SEED) -> Round | None:
    """Simulate a model on the recorded motion, and fit its parameters as those of the recording were.

    A model without a controller follows its setpoint under a law that is read off the recorded effort, roughly. For
    the arguments see `left_by_twin`; it is held against `nominal`.
    """
    records, looped = [], own
    if own.controller is None and (found := rough_law(stand.records, own)) is not None:
        looped = replace(own, controller=found[0])
    for record in stand.records:
        try:
            shown = simulate_record(looped, replay=record, seed=seed)
        except UnusableInputError:  # no controller nor setpoint, or a law under which this model runs away
            return None
        speeds = ("motor_velocity", "joint_velocity") if stand.lever > 0 else ()
        kept = {k: shown[k] for k in shown.channels if k in record.channels and k not in speeds}
        records.append(replace(shown, channels=kept))
    settled = settle_contract(records, nominal, ())
    return opening(settled.stand, settled.model, settled.level)
