"""What the fitted model itself would leave: the same motion simulated, with its sensors' noise, on a bench of its own.

A joint that sticks and slips, seen by its position alone, leaves more than the noise of its effort although nothing is
missing: the observer, shaken by the sensors, breaks away at other moments. And where no speed is logged and no law
tells it (see `told`), so that the effort is only known with its sensor's noise, feedback makes that noise look like
losses in the gearbox. Only twins tell how much of either is usual.
"""

from dataclasses import replace

import numpy as np

from gsfdi.errors import UnusableInputError
from gsfdi.model import JointModel
from gsfdi.motion import PhysicsTerm
from gsfdi.reconcile.bench import Bench
from gsfdi.reconcile.clean import rough_law
from gsfdi.reconcile.compete import contend, opening
from gsfdi.reconcile.contract import settle_contract
from gsfdi.reconcile.finalists import CHANCE, merit
from gsfdi.reconcile.hand import Round
from gsfdi.reconcile.noise import effort_floor
from gsfdi.reconcile.screen import Entry
from gsfdi.simulate import simulate_record

SEED = 1
TWINS = 4
"""Twins by which the usual gain of a term that is not there is told."""


def left_by_twin(stand: Bench, own: JointModel) -> float:
    """Torque noise that a twin leaves, as a share of the drive's torque; 0 where it cannot be simulated.

    Parameters
    ----------
    stand : Bench
        With the recordings whose motion it repeats.
    own : JointModel
        What it is simulated from.
    """
    twin = twin_of(stand, own)
    return 0.0 if twin is None else float(np.linalg.norm(twin.torque)) / stand.scales.torque


def is_imitated(first: Round, nominal: JointModel, winner: Entry, term: PhysicsTerm) -> bool:
    """Whether twins without a term, on which it gains something too, make a faint winner's merit nothing unusual.

    Parameters
    ----------
    first : Round
        Parameters only.
    nominal : JointModel
        The model whose numbers were fitted, with its own terms only.
    winner : Entry
        Of the contest that `first` held.
    term : PhysicsTerm
        The winner's.
    """
    fitted = first.fitted.model
    own = replace(nominal, plant=fitted.plant, physics=fitted.physics[: len(nominal.physics)])
    gains = []
    for seed in range(SEED, SEED + TWINS):
        twin = twin_of(first.stand, own, seed)
        if twin is None:
            return False
        given = len(twin.fitted.model.physics)
        contest, _ = contend(twin, {term.name: term}, effort_floor(twin.stand), given)
        gains.append(max((entry.gain for entry in contest.entries if entry.fitted is not None), default=0.0))
    usual = float(np.mean(np.maximum(gains, 0.0)))  # of a gain that falls off exponentially
    return merit(winner) < usual * float(np.log(1.0 / CHANCE))


def twin_of(stand: Bench, own: JointModel, seed: int = SEED) -> Round | None:
    """Simulate a model on the recorded motion, and fit its parameters as those of the recording were.

    A model without a controller follows its setpoint under a law that is read off the recorded effort, roughly. For
    the arguments see `left_by_twin`.
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
    settled = settle_contract(records, own, ())
    return opening(settled.stand, settled.model, settled.level)
