"""Effects that are faint, or hidden by what else is missing, and what only looks like one."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from joints import MODEL, along
from rigid import WET, swept

from gsfdi.model import Sensors, TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.finalists import SEEN, SLIP, unslipped
from gsfdi.reconcile.judge import ELSE, Name, Rival, weighed
from gsfdi.reconcile.law import check_law
from gsfdi.simulate import simulate_record

OWN = (
    TermUse("coulomb_friction", {"torque_nm": 2.0}, "motor"),
    TermUse("viscous_friction", {"coefficient_nms_rad": 20.0}, "motor"),
)


def test_a_mode_beyond_what_the_motion_excites_is_no_inertia() -> None:
    values = {"inertia_kg_m2": 7.34, "frequency_hz": 2.62, "damping_ratio": 0.02}
    waves = ((0.30, 0.14, 0.0), (0.06, 0.6, 1.0), (0.008, 2.4, 2.0))
    asked = along(simulate_record(MODEL, seed=217, duration=60.0), waves, middle=0.2)
    with_mode = replace(MODEL, physics=(*OWN, TermUse("structural_mode", values, "output")))
    record = simulate_record(with_mode, replay=asked, seed=217)
    (entry,) = reconcile([record], replace(MODEL, physics=OWN)).omitted_physics
    assert entry["term"] == "structural_mode"
    assert entry["parameters"]["frequency_hz"]["value"] == pytest.approx(2.62, rel=0.02)


@pytest.mark.thorough
def test_a_spot_that_is_met_once_does_not_mend_when_another_term_set_in() -> None:
    answer = swept(
        TermUse("viscous_friction", {"coefficient_nms_rad": 1.8154}, None, 24.6124),
        TermUse("constant_load", {"torque_nm": 0.91069}),
        TermUse("torque_ripple", {"amplitude_ratio": 0.086778, "order": 8.0, "phase_rad": 2.1918}),
        own=(WET,),
    )
    found = {entry["term"]: entry["onset_s"] for entry in answer.omitted_physics}
    assert sorted(found) == ["constant_load", "torque_ripple", "viscous_friction"]
    assert found["viscous_friction"] == pytest.approx(24.6124, abs=0.0101)


def standing(rows: tuple[int, ...], speed: float) -> Any:
    """Bench of no record in which a joint would move, with so much noise of its `speed`."""
    system = SimpleNamespace(rows=rows, R=np.array([1e-10, speed**2]), C=np.array([[1.0, 0.0], [0.0, 1.0]]))
    scales = SimpleNamespace(noise=1e-5, period=0.01)
    return SimpleNamespace(records=[], system=system, scales=scales, sees_speed=1 in rows)


def test_a_slow_slip_hides_in_the_noise_of_a_speed() -> None:
    assert unslipped(standing((0,), 1e-3), 2.0) == pytest.approx(SLIP * 1e-5)
    assert unslipped(standing((0, 1), 1e-6), 2.0) == pytest.approx(SEEN * 1e-5)
    assert unslipped(standing((0, 1), 4e-4), 2.0) == pytest.approx(SEEN * 4e-5)
    assert unslipped(standing((0, 1), 1.0), 2.0) == pytest.approx(SLIP * 1e-5)


def test_what_is_fifty_times_less_likely_is_not_told_apart() -> None:
    drag, warm = TermUse("viscous_friction", {}), TermUse("temperature_dependent_friction", {})
    assert Name(drag, 0.98, 1.0, {}, (Rival(warm, -4.0, 0.02),)).close == ("temperature_dependent_friction",)
    assert Name(drag, 0.995, 1.0, {}, (Rival(warm, -6.0, 0.005),)).close == ()


@pytest.mark.parametrize("ahead", [0.0, 3.0, 1e3])
def test_some_probability_is_left_for_what_nobody_thought_of(ahead: float) -> None:
    drag, warm = TermUse("viscous_friction", {}), TermUse("temperature_dependent_friction", {})
    rival: Any = SimpleNamespace(model=SimpleNamespace(physics=(warm,)))
    name, _ = weighed(drag, ahead, [(-ahead, rival)], [0.0])
    assert name.probability == pytest.approx((1.0 - ELSE) / (1.0 + np.exp(-ahead)))
    assert name.certainty <= 1.0 - ELSE + 1e-12


@pytest.mark.parametrize("name", ["proportional", "integral", "derivative"])
def test_a_gain_that_is_a_little_off_is_found_where_a_speed_is_logged(name: str) -> None:
    law, ratio = MODEL.controller, {"proportional": 1.0015, "integral": 1.0025, "derivative": 1.0025}[name]
    assert law is not None
    made = replace(MODEL, controller=replace(law, **{name: ratio * getattr(law, name)}))
    (entry,) = reconcile([simulate_record(made, seed=1, duration=120.0)], MODEL).omitted_physics
    assert entry["term"] == f"controller_{name}"
    assert entry["parameters"]["ratio"]["value"] == pytest.approx(ratio, abs=5e-4)


def test_a_gain_that_differs_by_arithmetic_only_has_no_name() -> None:
    law, quiet = MODEL.controller, replace(MODEL, sensors=Sensors(effort_noise=1e-9))
    assert law is not None
    gains = [law.proportional * ratio for ratio in (1.0001, 1.0002)]
    off = [replace(quiet, controller=replace(law, proportional=gain)) for gain in gains]
    record = simulate_record(quiet, seed=5, duration=30.0)
    rounded, set_off = (check_law([record], model) for model in off)
    assert rounded is not None
    assert set_off is not None
    assert not rounded.findings
    assert [finding.term for finding in set_off.findings] == ["controller_proportional"]


@pytest.mark.parametrize("seed", range(6))
def test_nothing_is_found_in_a_law_that_holds(seed: int) -> None:
    check = check_law([simulate_record(MODEL, seed=seed, duration=60.0)], MODEL)
    assert check is not None
    assert check.findings == ()


def test_a_stamp_that_is_late_by_a_tick_and_a_little_blames_no_gearbox() -> None:
    late = replace(MODEL, physics=(TermUse("timestamp_latency", {"delay_s": 0.01005}),))
    record = simulate_record(late, seed=3, duration=120.0)
    entries = {entry["term"]: entry for entry in reconcile([record], MODEL).omitted_physics}
    assert set(entries) == {"timestamp_latency"}
    assert entries["timestamp_latency"]["parameters"]["delay_s"]["value"] == pytest.approx(0.01005, abs=2e-5)
