"""Appendages that swing: the pull of one by linear theory, and finding it wherever its narrow resonance lies."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from rigid import JOINT

from gsfdi.model import TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.modes import DAMPING, pull, worthy_frequencies
from gsfdi.simulate import simulate_record


@pytest.mark.parametrize("frequency", [0.5, 2.0, 7.0])
def test_an_appendage_pulls_as_den_hartog_has_it(frequency: float) -> None:
    t = np.arange(0, 200, 0.01)
    s, omega = 2j * np.pi * 1.5, 2 * np.pi * frequency
    drag = 2 * DAMPING * omega * s
    expected = (np.exp(s * t) * s * (omega**2 + drag) / (s**2 + drag + omega**2)).imag
    late = t > 150
    found = pull(np.sin(2 * np.pi * 1.5 * t), frequency, 0.01)
    np.testing.assert_allclose(found[late], expected[late], atol=0.02 * np.abs(expected[late]).max())


@pytest.mark.parametrize(("frequency", "share"), [(0.7, 0.005), (1.02, 0.01), (4.3, 0.05)])
def test_a_light_appendage_is_found_wherever_it_rings(frequency: float, share: float) -> None:
    inertia = share * JOINT.plant.output_inertia
    use = TermUse("structural_mode", {"inertia_kg_m2": inertia, "frequency_hz": frequency, "damping_ratio": 0.01})
    answer = reconcile([simulate_record(replace(JOINT, physics=(use,)), seed=3, duration=60.0)], JOINT)
    (entry,) = answer.omitted_physics
    assert entry["term"] == "structural_mode"
    assert entry["parameters"]["frequency_hz"]["value"] == pytest.approx(frequency, rel=0.01)
    assert entry["parameters"]["inertia_kg_m2"]["value"] == pytest.approx(inertia, rel=0.1)


def test_an_appendage_may_swing_already_as_a_recording_begins() -> None:
    use = TermUse("structural_mode", {"inertia_kg_m2": 0.1, "frequency_hz": 2.0, "damping_ratio": 0.005})
    whole = simulate_record(replace(JOINT, physics=(use,)), seed=3, duration=60.0)
    late = whole.t > 25.0
    channels = {name: whole[name][late] for name in whole.channels}
    cut = replace(whole, t=whole.t[late] - whole.t[late][0], channels=channels, valid={})
    answer = reconcile([cut], JOINT)
    (entry,) = answer.omitted_physics
    low, high = entry["parameters"]["damping_ratio"]["ci95"]
    assert (answer.verdict, entry["term"]) == ("explained", "structural_mode")
    assert low < 0.005 < high < 0.01


def test_a_recording_too_slow_for_any_mode_offers_none() -> None:
    stand = SimpleNamespace(scales=SimpleNamespace(period=1.0))
    assert worthy_frequencies(SimpleNamespace(stand=stand)) == {"structural_mode": ()}  # type: ignore[arg-type]
