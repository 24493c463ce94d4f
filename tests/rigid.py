"""A plain rigid joint for the tests of reconcile, of which every number is known."""

from gsfdi.model import Controller, JointModel, Plant, Sensors

JOINT = JointModel(
    name="J",
    structure="rigid",
    plant=Plant(output_inertia=2.0, gear_ratio=1.0, torque_constant=1.0),
    controller=Controller(200.0, 100.0, 40.0, 100.0, effort="drive_torque"),
    sensors=Sensors(position_noise=1e-5, motor_velocity_noise=1e-3, effort_noise=0.01),
    effort="drive_torque",
)
