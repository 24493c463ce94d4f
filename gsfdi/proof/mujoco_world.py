"""A second world, whose physics is MuJoCo's: armature, frictionloss, joint springs, a gap between two hinges, dcmotor.

The joint is a chain of hinges about one axis: the rotor against the ground, a gap of limited range if there is
backlash, the gearbox spring, the link, and an appendage if there is one. Cogging and LuGre friction are those of
MuJoCo's dcmotor, delay is its actuator's. Only flexible rotary joints without damping of the link against the ground;
optional, as MuJoCo is. With nothing left out the two worlds agree to a thousandth of the sensors' noise.
"""

import importlib.util
from collections.abc import Mapping
from typing import Any

import numpy as np

from gsfdi.proof.world import LEAD_IN, Effect, Joint, Motion, World
from gsfdi.types import Array

STEP = 1e-3  # [s]
MUJOCO_KINDS = (
    "cogging",
    "actuation_delay",
    "motor_inertia_change",
    "coulomb_friction",
    "viscous_friction",
    "presliding_friction",
    "stiffness_change",
    "backlash",
    "gearbox_damping",
    "output_inertia_change",
    "structural_mode",
    "constant_load",
)
"""Kinds of effect that this world can play, all but the last two groups on the rotor's side."""


def available() -> bool:
    """Whether MuJoCo is installed, in a version that has a dcmotor."""
    if importlib.util.find_spec("mujoco") is None:
        return False
    import mujoco

    return hasattr(mujoco.MjsActuator, "set_to_dcmotor")


def _sum(effects: tuple[Effect, ...], term: str, name: str) -> float:
    return float(sum(effect.values[name] for effect in effects if effect.term == term))


def _ratio(effects: tuple[Effect, ...], term: str) -> float:
    return float(np.prod([effect.values["ratio"] for effect in effects if effect.term == term]))


def _hinge(body: Any, name: str, **given: Any) -> None:
    import mujoco

    body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=[0, 0, 1], **given)


def _body(parent: Any, inertia: float) -> Any:
    """Add a body of this inertia about the axis, at the axis."""
    body = parent.add_body()
    body.mass, body.inertia, body.explicitinertial = 1.0, [inertia] * 3, True
    return body


def model_of(world: World) -> Any:
    """Build the chain of hinges."""
    import mujoco

    joint, effects = world.joint, (*world.known, *world.effects)
    spec = mujoco.MjSpec()
    spec.option.timestep, spec.option.gravity = STEP, [0.0, 0.0, 0.0]
    spec.option.integrator, spec.compiler.degree = mujoco.mjtIntegrator.mjINT_RK4, False
    rotor = _body(spec.worldbody, 1e-6)
    inertia = joint.motor_inertia * joint.gear_ratio**2 * _ratio(effects, "motor_inertia_change")
    dry, wet = (
        _sum(effects, "coulomb_friction", "torque_nm"),
        _sum(effects, "viscous_friction", "coefficient_nms_rad"),
    )
    _hinge(rotor, "rotor", armature=inertia, frictionloss=dry, damping=[wet, 0, 0])
    half, drive = _sum(effects, "backlash", "half_width_rad"), rotor
    if half > 0.0:
        drive = _body(rotor, 0.2)
        _hinge(drive, "gap", limited=True, range=[-half, half], solref_limit=[2 * STEP, 1.0], damping=[5.0, 0, 0])
    link = _body(drive, joint.output_inertia * _ratio(effects, "output_inertia_change"))
    loss = _sum(effects, "gearbox_damping", "coefficient_nms_rad")
    spring = joint.stiffness * _ratio(effects, "stiffness_change")
    _hinge(link, "spring", stiffness=[spring, 0, 0], damping=[loss, 0, 0])
    for effect in effects:
        if effect.term == "structural_mode":
            size, omega = effect.values["inertia_kg_m2"], 2 * np.pi * effect.values["frequency_hz"]
            drag = 2 * effect.values["damping_ratio"] * omega * size
            _hinge(_body(link, size), "swing", stiffness=[size * omega**2, 0, 0], damping=[drag, 0, 0])
    _motors(spec, joint, effects)
    return spec.compile()


def _motors(spec: Any, joint: Joint, effects: tuple[Effect, ...]) -> None:
    """Add the drive, and beside it a dcmotor without voltage for what it has of cogging and bristles."""
    import mujoco

    def on_rotor(name: str) -> Any:
        return spec.add_actuator(name=name, trntype=mujoco.mjtTrn.mjTRN_JOINT, target="rotor")

    drive = on_rotor("drive")
    drive.set_to_motor()
    drive.gear = [joint.torque_constant * joint.gear_ratio, 0, 0, 0, 0, 0]
    delay = _sum(effects, "actuation_delay", "delay_s")
    if delay > 0.0:
        drive.delay, drive.nsample = delay, int(np.ceil(delay / STEP)) + 2
    for k, effect in enumerate(effects):
        v = effect.values
        given: Mapping[str, list[float]] = {}
        if effect.term == "cogging":
            given = {"cogging": [v["amplitude_nm"], v["order"] * joint.gear_ratio, v["phase_rad"]]}
        elif effect.term == "presliding_friction":
            damper = 0.02 * v["stiffness_nm_rad"]
            given = {"lugre": [v["stiffness_nm_rad"], damper, v["torque_nm"], v["torque_nm"], 1.0]}
        if given:
            on_rotor(f"extra-{k}").set_to_dcmotor(motorconst=[1.0, 1.0], resistance=1e12, **given)


def run_mujoco(world: World, motion: Motion, seed: int, *, noisy: bool = True) -> Array:
    """Let MuJoCo move the world under the joint's controller; the same columns as `world.run`."""
    import mujoco

    joint, rng = world.joint, np.random.default_rng((seed, 1))
    model = model_of(world)
    data = mujoco.MjData(model)
    dt, per_tick = 1.0 / joint.sample_rate, round(1.0 / joint.sample_rate / STEP)
    lead = round(LEAD_IN / dt)
    rows = lead + motion.t.size
    noise = rng.standard_normal((rows, 3)) * [joint.position_noise, joint.motor_velocity_noise, joint.effort_noise]
    noise *= float(noisy)
    loads = [effect for effect in world.effects if effect.term == "constant_load"]
    chain = [model.joint(name).dofadr[0] for name in ("gap", "spring") if _has(model, name)]
    rotor, spring = model.joint("rotor").dofadr[0], model.joint("spring").dofadr[0]
    data.qpos[rotor] = motion.setpoint[0]
    out, integral, before = np.empty((rows, 7)), 0.0, 0.0
    for k in range(rows):
        now = max(k - lead, 0)
        turn, speed = float(data.qpos[rotor]), float(data.qvel[rotor])
        true = turn + float(data.qpos[chain].sum())
        y = true + noise[k, 0]
        if noisy and joint.position_resolution > 0.0:
            y = round(y / joint.position_resolution) * joint.position_resolution
        w = joint.gear_ratio * speed + noise[k, 1]
        rate = motion.rate[now] if k >= lead else 0.0
        error = motion.setpoint[now] - y
        integral += 0.5 * (error + before) * dt if k else 0.0
        before = error
        command = joint.proportional * error + joint.integral * integral
        command += joint.derivative * (joint.rate_feedforward * rate - w / joint.gear_ratio)
        out[k] = y, w, command + noise[k, 2], true - turn, turn, speed + float(data.qvel[chain].sum()), command
        data.ctrl[0] = command
        elapsed = motion.t[now] if k >= lead else -1.0
        # a load on the link in absolute terms acts on every hinge below it
        torque = -sum(e.values["torque_nm"] for e in loads if e.onset is None or elapsed >= e.onset)
        data.qfrc_applied[[rotor, *chain]] = torque
        mujoco.mj_step(model, data, per_tick)
    assert spring in chain
    return out[lead:]


def _has(model: Any, name: str) -> bool:
    import mujoco

    return bool(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, name) >= 0)
