"""The same joints in MuJoCo, an engine that shares nothing with ours but the laws of motion."""

from dataclasses import replace

import numpy as np
import pytest

from gsfdi.drive import drive_from
from gsfdi.model import JointModel, Plant, TermUse
from gsfdi.simulate import replay
from gsfdi.starting import Signals, Start
from gsfdi.types import Array

mujoco = pytest.importorskip("mujoco")

MOTOR, LINK, SPRING = 74.7, 400.0, 20000.0
JOINT = JointModel("j", "flexible", Plant(LINK, MOTOR, 1.0, SPRING, 0.0, 1.0))
STEP, EVERY, SAMPLES = 2e-4, 50, 400  # a sample each 10 ms
T = np.arange(SAMPLES) * STEP * EVERY
PUSH = 30.0 * np.sin(2 * np.pi * T / 1.7) * (T < 3.4)

MASSLESS = '<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>'
TWO_HINGES = """
<mujoco><option timestep="{step}" gravity="0 0 0" integrator="implicitfast"/><worldbody>
<body><joint name="motor" axis="0 0 1" armature="{motor}" {on_motor}/>{massless}{gap}
<body><joint name="windup" axis="0 0 1" stiffness="{spring}"/>
<inertial pos="0 0 0" mass="1" diaginertia="{link} {link} {link}"/></body>{close}
</body></worldbody><actuator><motor name="push" joint="motor"/>{actuators}</actuator></mujoco>
"""


def in_mujoco(on_motor: str = "", actuators: str = "", gap: str = "", finer: int = 1) -> Array:
    """Joint angle by sample."""
    text = TWO_HINGES.format(
        step=STEP / finer,
        motor=MOTOR,
        link=LINK,
        spring=SPRING,
        massless=MASSLESS,
        on_motor=on_motor,
        actuators=actuators,
        gap=gap,
        close="</body>" * bool(gap),
    )
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    angle = []
    for push in PUSH:
        angle.append(data.qpos.sum())
        data.ctrl[0] = push
        for _ in range(EVERY * finer):
            mujoco.mj_step(model, data)
    return np.array(angle)


def in_gsfdi(*uses: TermUse) -> Array:
    blank = np.full(T.size, np.nan)
    signals = Signals(T, blank, blank, 0 * T, PUSH, blank, blank, 0 * T + 20)
    drive = drive_from(signals, JOINT, Start(0, 0, 0, 0, 0))
    return replay(replace(JOINT, physics=uses), drive, "open_loop").position


def apart(one: Array, other: Array) -> float:
    return float(np.max(np.abs(one - other)) / np.ptp(other))


def test_armature_and_spring() -> None:
    assert apart(in_gsfdi(), in_mujoco()) < 1e-3


def test_damping() -> None:
    mine = in_gsfdi(TermUse("viscous_friction", {"coefficient_nms_rad": 50.0}, "motor"))
    assert apart(mine, in_mujoco('damping="50"')) < 1e-3
    assert apart(mine, in_gsfdi()) > 0.05


def test_frictionloss() -> None:
    mine = in_gsfdi(TermUse("coulomb_friction", {"torque_nm": 8.0}, "motor"))
    assert apart(mine, in_mujoco('frictionloss="8" solreffriction="0.001 1"')) < 5e-3
    assert apart(mine, in_gsfdi()) > 0.05


def test_backlash_of_two_hinges() -> None:
    stops = 'range="-0.2 0.2" limited="true" solreflimit="0.0005 1"'
    gap = f'<body><joint name="gap" axis="0 0 1" armature="0.2" {stops}/>{MASSLESS}'
    mine = in_gsfdi(TermUse("backlash", {"half_width_rad": np.deg2rad(0.2)}))
    assert apart(mine, in_gsfdi()) > 0.005
    assert apart(mine, in_mujoco(gap=gap, finer=4)) < 0.2 * apart(mine, in_gsfdi())


def test_cogging_of_a_dc_motor() -> None:
    mine = in_gsfdi(TermUse("cogging", {"amplitude_nm": 5.0, "order": 40.0, "phase_rad": 0.3}))
    theirs = '<dcmotor joint="motor" input="none" motorconst="1e-6" resistance="1" cogging="-5 40 0.3"/>'
    assert apart(mine, in_mujoco(actuators=theirs)) < 2e-3
    assert apart(mine, in_gsfdi()) > 0.02


def test_lugre_of_a_dc_motor() -> None:
    """With equal static and Coulomb torque and no bristle damping LuGre is Dahl's presliding friction."""
    mine = in_gsfdi(TermUse("presliding_friction", {"torque_nm": 8.0, "stiffness_nm_rad": 20000.0}, "motor"))
    theirs = '<dcmotor joint="motor" input="none" motorconst="1e-6" resistance="1" lugre="20000 0 8 8 1"/>'
    assert apart(mine, in_mujoco(actuators=theirs)) < 5e-3
    assert apart(mine, in_gsfdi()) > 0.05
