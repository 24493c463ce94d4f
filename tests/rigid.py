"""A plain rigid joint for the tests of reconcile, of which every number is known."""

from dataclasses import replace

from joints import along

from gsfdi.model import Controller, JointModel, Plant, Sensors, TermUse
from gsfdi.reconcile import Reconciliation, reconcile
from gsfdi.simulate import simulate_record

JOINT = JointModel(
    name="J",
    structure="rigid",
    plant=Plant(output_inertia=2.0, gear_ratio=1.0, torque_constant=1.0),
    controller=Controller(200.0, 100.0, 40.0, 100.0, effort="drive_torque"),
    sensors=Sensors(position_noise=1e-5, motor_velocity_noise=1e-3, effort_noise=0.01),
    effort="drive_torque",
)
OWN = (TermUse("coulomb_friction", {"torque_nm": 2.0}),)
WET = TermUse("viscous_friction", {"coefficient_nms_rad": 10.0})


def swept(*terms: TermUse, own: tuple[TermUse, ...] = OWN) -> Reconciliation:
    """Reconcile a joint that sweeps both ways, at up to 0.5 rad/s, and whose model knows its `own` terms."""
    waves = ((0.35, 0.5, 0.0), (0.12, 1.7, 1.0), (0.03, 4.1, 2.0))
    asked = along(simulate_record(JOINT, duration=40.0), waves)
    record = simulate_record(replace(JOINT, physics=(*own, *terms)), replay=asked, seed=1)
    return reconcile([record], replace(JOINT, physics=own))
