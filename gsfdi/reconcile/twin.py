"""What the fitted model itself would leave: the same motion simulated, with its sensors' noise, on a bench of its own.

A joint that sticks and slips, seen by its position alone, leaves more than the noise of its effort although nothing is
missing: the observer, shaken by the sensors, breaks away at other moments. Only a twin tells how much more.
"""

from dataclasses import replace

import numpy as np

from gsfdi.errors import UnusableInputError
from gsfdi.model import JointModel
from gsfdi.reconcile.compete import opening
from gsfdi.reconcile.contract import settle_contract
from gsfdi.reconcile.hand import Round
from gsfdi.simulate import simulate_record

SEED = 1


def left_by_twin(first: Round, nominal: JointModel) -> float:
    """Torque noise that the twin of `first` leaves, as a share of the drive's torque; 0 where it cannot be simulated.

    Parameters
    ----------
    first : Round
        Parameters only.
    nominal : JointModel
        The model whose numbers were fitted, with its own terms only.
    """
    fitted = first.fitted.model
    own = replace(nominal, plant=fitted.plant, physics=fitted.physics[: len(nominal.physics)])
    records = []
    for record in first.stand.records:
        try:
            shown = simulate_record(own, replay=record, seed=SEED)
        except UnusableInputError:  # no controller, or one under which this model runs away
            return 0.0
        records.append(replace(shown, channels={k: shown[k] for k in shown.channels if k in record.channels}))
    settled = settle_contract(records, own, ())
    return (
        float(np.linalg.norm(opening(settled.stand, settled.model, settled.level).torque)) / first.stand.scales.torque
    )
