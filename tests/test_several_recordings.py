"""Several recordings of one joint, reconciled as one."""

from dataclasses import replace

import numpy as np
import pytest
from rigid import JOINT

from gsfdi.errors import UnusableInputError
from gsfdi.model import TermUse
from gsfdi.reconcile.bench import bench
from gsfdi.simulate import simulate_record

STICKY = replace(JOINT, physics=(TermUse("coulomb_friction", {"torque_nm": 0.4}),))


def test_a_part_of_every_recording_is_kept_for_judging_however_short_it_is() -> None:
    long = replace(simulate_record(STICKY, seed=1, duration=40.0), source="long")
    short = replace(simulate_record(STICKY, seed=2, duration=20.0), source="short")
    stand = bench([long, short], STICKY)
    shares = [float(np.mean(stand.kept(i))) for i in range(2)]
    assert np.allclose(shares, stand.window[1] - stand.window[0], atol=0.01)
    assert not np.any(stand.awake(1)[np.repeat(stand.kept(1), len(stand.system.rows))])


def test_a_recording_too_short_to_be_judged_is_said_to_be_so() -> None:
    fast = replace(JOINT, controller=replace(JOINT.controller, sample_rate=500.0))  # type: ignore[type-var]
    with pytest.raises(UnusableInputError, match="no stretch of 1 s"):
        bench([simulate_record(fast, seed=1, duration=0.4)], fast)
