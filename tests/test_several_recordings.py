"""Several recordings of one joint, reconciled as one."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from joints import MODEL
from rigid import JOINT

from gsfdi.errors import UnusableInputError
from gsfdi.fit import START
from gsfdi.model import JointModel, TermUse
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.hand import started
from gsfdi.reconcile.knobs import start_knobs
from gsfdi.simulate import innovations_of, simulate_record
from gsfdi.types import Array

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


def test_what_one_recording_begins_with_is_replayed_beside_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    sources = [replace(simulate_record(MODEL, seed=seed, duration=10.0), source=str(seed)) for seed in range(2)]
    stand = bench(sources, MODEL)
    knobs = [knob for knob in start_knobs(stand) if knob.place == START]
    models = [knob.turn(started(MODEL, 2), knob.scale) for knob in knobs] + [started(MODEL, 2)]
    apart = [stand.innovations([model]) for model in models]
    replayed: list[int] = []

    def counting(some: Sequence[JointModel], *rest: Any) -> Array:
        replayed.append(len(some))
        return innovations_of(some, *rest)

    monkeypatch.setattr("gsfdi.reconcile.bench.innovations_of", counting)
    for together, *alone in zip(stand.innovations(models), *apart, strict=True):
        np.testing.assert_array_equal(together, np.concatenate(alone))
    assert replayed == [2, 2]
