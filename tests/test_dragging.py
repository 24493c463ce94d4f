"""A drive that frictions and a load take most of the effort of, by a model that knows its mass and its loop alone."""

from dataclasses import replace

import numpy as np
import pytest

from gsfdi.model import Controller, JointModel, Plant, Sensors, TermUse
from gsfdi.reconcile import reconcile
from gsfdi.reconcile.bench import bench
from gsfdi.reconcile.verify import SILENCED, strays
from gsfdi.simulate import simulate_record
from gsfdi.types import JointRecord

DRIVE = JointModel(
    name="D",
    structure="rigid",
    plant=Plant(output_inertia=95.0, gear_ratio=1.0, torque_constant=1.0),
    controller=Controller(1.4e5, 0.0, 4e3, 250.0, effort="drive_torque", rate_feedforward=0.0),
    sensors=Sensors(position_noise=2e-7, motor_velocity_noise=1e-5, effort_noise=0.5),
    effort="drive_torque",
)


def dragged(dry: float, wet: float, load: float) -> JointModel:
    """Give the drive its frictions and a load."""
    uses = (
        TermUse("coulomb_friction", {"torque_nm": dry}),
        TermUse("viscous_friction", {"coefficient_nms_rad": wet}),
        TermUse("constant_load", {"torque_nm": load}),
    )
    return replace(DRIVE, physics=uses)


def swung(model: JointModel, seed: int = 1) -> JointRecord:
    """Telemetry of 20 s of slow swings, of which the mass takes little."""
    t = 0.004 * np.arange(5000)
    begins = np.clip(0.5 * t, 0.0, 1.0) ** 2 * (3.0 - 2.0 * np.clip(0.5 * t, 0.0, 1.0))
    way = 0.05 * np.sin(0.7 * t) + 0.012 * (np.sin(2.0 * t + 1.0) - np.sin(1.0))
    asked = replace(simulate_record(DRIVE, duration=1.0), t=t, channels={"setpoint": begins * way}, valid={})
    return simulate_record(model, replay=asked, seed=seed)


@pytest.mark.parametrize(
    ("dry", "wet", "load"), [(14.0, 143.0, -14.0), pytest.param(30.0, 300.0, 30.0, marks=pytest.mark.thorough)]
)
def test_three_things_that_drag_are_no_drive_that_moves_nothing(dry: float, wet: float, load: float) -> None:
    answer = reconcile([swung(dragged(dry, wet, load))], DRIVE)
    found = {e["term"]: next(iter(e["parameters"].values()))["value"] for e in answer.omitted_physics}
    assert answer.verdict == "explained"
    assert found == {
        "coulomb_friction": pytest.approx(dry, rel=0.01),
        "viscous_friction": pytest.approx(wet, rel=0.01),
        "constant_load": pytest.approx(load, rel=0.01),
    }
    assert answer.fit["after"]["drive_torque_nm"] < 0.1 * answer.fit["before"]["drive_torque_nm"]


def test_a_mass_that_would_ask_for_other_efforts_leads_astray_and_a_friction_does_not() -> None:
    stand = bench([swung(dragged(14.0, 143.0, -14.0))], DRIVE)
    heavy, weighty = (
        replace(DRIVE, plant=replace(DRIVE.plant, output_inertia=times * DRIVE.plant.output_inertia))
        for times in (20.0, 6.0)
    )
    assert strays(stand, DRIVE, heavy)
    assert not strays(stand, DRIVE, weighty)
    assert strays(stand, DRIVE, weighty, most=SILENCED)
    assert not strays(stand, DRIVE, replace(DRIVE, physics=dragged(14.0, 143.0, -14.0).physics[:1]))
    assert not strays(stand, replace(DRIVE, controller=None), replace(heavy, controller=None))
