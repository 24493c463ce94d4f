"""How well the effect of a case hides: the same world with and without it, on the same noise."""

from dataclasses import dataclass, replace

import numpy as np

from gsfdi.channels import CHANNELS
from gsfdi.proof.cases import Case
from gsfdi.proof.kinds import KINDS
from gsfdi.proof.world import Joint, World, recorded, tuned
from gsfdi.types import Array

PROBED = ("output_inertia", "motor_inertia", "stiffness", "torque_constant")


@dataclass(frozen=True, slots=True)
class Concealment:
    """What the effect changes.

    Parameters
    ----------
    tracking : float
        Relative change of the RMS of setpoint minus measured position.
    position, motor_velocity, effort, windup : float
        RMS of the change in units of that channel's own noise (for wind-up, which no sensor gives, of the noise of
        position).
    visible : float
        Strength of the effect over all logged channels and samples in standard deviations: the norm of its change, in
        noise units, after everything has been taken out of it that other numbers of the linear model would explain.
    """

    tracking: float
    position: float
    motor_velocity: float
    effort: float
    windup: float
    visible: float


def _noise(case: Case, spread: Array) -> Array:
    """Spread of what sensor noise does to position, motor speed and effort, directly and through the loop."""
    joint = case.world.joint
    floor = np.maximum([joint.position_resolution, joint.motor_velocity_resolution, joint.effort_resolution], 1e-12)
    noise: Array = np.maximum(spread.std(axis=0), floor * 12**-0.5)
    return noise


def _logged(case: Case, runs: list[Array], noise: Array) -> Array:
    """All logged samples of all motions in noise units, one long vector."""
    columns = [0, 1, 2] if case.telemetry.motor_velocity else [0, 2]
    kept = [recorded(motion.t, case.telemetry) for motion in case.motions]
    logged = [traces[rows][:, columns] for traces, rows in zip(runs, kept, strict=True)]
    return np.concatenate([(traces / noise[columns]).ravel() for traces in logged])


def _probes(case: Case, world: World, joint: Joint) -> list[tuple[World, float]]:
    """Worlds in which one number of the linear model, or of the friction known beforehand, is a percent higher."""
    worlds = []
    for name in PROBED:
        value = getattr(joint, name)
        if (
            value > 0.0
            and np.isfinite(value)
            and not (joint.structure == "rigid" and name in ("stiffness", "motor_inertia"))
        ):
            worlds.append((replace(world, joint=tuned(joint, {name: value * 1.01})), 0.01))
    for k, effect in enumerate(world.known):
        more = replace(effect, values={key: value * 1.02 for key, value in effect.values.items()})
        worlds.append((replace(world, known=(*world.known[:k], more, *world.known[k + 1 :])), 0.02))
    return worlds


def concealment(case: Case) -> tuple[Concealment, dict[str, float]]:
    """Measure how well the effect of a case hides, and the oracle's misfit.

    The oracle is the true world run without noise: what it leaves of the recordings (RMS by column) no model can beat.
    """
    clean = case.world.without()
    if any(KINDS[name].family == "controller" for name in case.design.kinds):
        clean = replace(clean, joint=tuned(case.world.joint, _believed_gains(case)))
    with_it, without = case.runs(), case.runs(clean)
    quiet, still = case.runs(noisy=False), case.runs(clean, noisy=False)
    spread = np.vstack([a[:, :3] - b[:, :3] for a, b in zip(with_it, quiet, strict=True)])
    noise = _noise(case, spread)
    change = _logged(case, quiet, noise) - _logged(case, still, noise)
    parameter = any(KINDS[name].family == "parameter" for name in case.design.kinds)
    if not parameter and case.design.kinds:
        base = _logged(case, still, noise)
        probes = [
            _logged(case, case.runs(world, noisy=False), noise) - base for world, _ in _probes(case, clean, clean.joint)
        ]
        if probes:
            directions = np.column_stack(probes)
            change = change - directions @ np.linalg.lstsq(directions, change, rcond=1e-9)[0]
    delta = np.vstack([a - b for a, b in zip(with_it, without, strict=True)])
    setpoint = np.concatenate([motion.setpoint for motion in case.motions])
    error, before = (float(np.std(np.concatenate([r[:, 0] for r in runs]) - setpoint)) for runs in (with_it, without))
    rms = np.sqrt(np.mean(delta[:, :4] ** 2, axis=0)) / np.array([*noise, noise[0]])
    position, speed, effort, windup = (float(x) for x in rms)
    hidden = Concealment(error / before - 1.0, position, speed, effort, windup, float(np.linalg.norm(change)))
    names = ("position", "motor_velocity", case.world.joint.effort)
    left = np.sqrt(np.mean(spread**2, axis=0))
    return hidden, {CHANNELS[name].column(case.world.joint.axis): float(left[k]) for k, name in enumerate(names)}


def _believed_gains(case: Case) -> dict[str, float]:
    return {name: getattr(case.nominal, name) for name in ("proportional", "integral", "derivative")}
