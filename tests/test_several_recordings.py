"""Several recordings of one joint, reconciled as one."""

from dataclasses import replace

import numpy as np

from gsfdi.model import Controller, JointModel, Plant, Sensors, TermUse
from gsfdi.reconcile.bench import bench
from gsfdi.simulate import simulate_record

JOINT = JointModel(
    name="J",
    structure="rigid",
    plant=Plant(output_inertia=2.0, gear_ratio=1.0, torque_constant=1.0),
    controller=Controller(200.0, 100.0, 40.0, 100.0, effort="drive_torque"),
    sensors=Sensors(position_noise=1e-5, motor_velocity_noise=1e-3, effort_noise=0.01),
    physics=(TermUse("coulomb_friction", {"torque_nm": 0.4}),),
    effort="drive_torque",
)


def test_a_part_of_every_recording_is_kept_for_judging_however_short_it_is() -> None:
    long = replace(simulate_record(JOINT, seed=1, duration=40.0), source="long")
    short = replace(simulate_record(JOINT, seed=2, duration=20.0), source="short")
    stand = bench([long, short], JOINT)
    shares = [float(np.mean(stand.kept(i))) for i in range(2)]
    assert np.allclose(shares, stand.window[1] - stand.window[0], atol=0.01)
    assert not np.any(stand.awake(1)[np.repeat(stand.kept(1), len(stand.system.rows))])
