"""The laws of the proof's own world, compiled: what turns motor and link, and how they move through one short step.

Dry friction is a set-valued impulse that stops a body exactly where it would stick; presliding and gearbox hysteresis
are stacks of Maxwell slip elements; backlash is a gap between two contact flanks; viscous losses are implicit midpoint.

Shared arguments: `p` the table of effects in force (`effects`), `plant` the numbers of `integrator.PLANT`, `s` the
state (indices below), `h` the step [s].
"""

import math

import numba
import numpy as np

from gsfdi.proof.effects import (
    ASYM_L,
    ASYM_M,
    BACKLASH,
    BUMP,
    COG,
    COULOMB_L,
    COULOMB_M,
    CREEP,
    DEMAG,
    DRIFT,
    GEAR_DAMPING,
    GRAVITY,
    HARNESS,
    HYSTERESIS,
    KT,
    LOAD,
    LOAD_FRICTION,
    MESH,
    MODE,
    PAYLOAD,
    PRESLIDE_L,
    PRESLIDE_M,
    QUADRATIC,
    RIPPLE,
    SATURATION,
    SECTOR,
    SLIP,
    STIFFENING,
    STIFFNESS,
    STOP,
    STRIBECK_L,
    STRIBECK_M,
    TEMP_FRICTION,
    THINNING,
    VISCOUS_L,
    VISCOUS_M,
)
from gsfdi.types import Array

XM, VM, XL, VL, XA, VA, HEAT, LAG = range(8)
"""State: angle and speed of motor, link and appendage (all at the output), mean square of the current, a memory."""

HARDER = 2.0  # by how much a harness that hardens is stiffer at a bend of 1 [1/rad²]
TURN = 5e-4  # speed over which a smooth friction turns round [rad/s or m/s]
ELEMENTS = 48  # slip elements in a stack; their yield points spread over the exponential virgin curve
_FINE = (np.arange(100 * ELEMENTS) + 0.5) / (100 * ELEMENTS)
_EDGES = -np.log(1.0 - _FINE).reshape(ELEMENTS, -1).mean(axis=1)  # together they slip at the whole torque


@numba.njit(cache=True, error_model="numpy")
def slide(stack: Array, move: float, torque: float, reach: float) -> float:
    """Move a stack of slip elements by `move` and return its torque; the virgin curve is torque (1 - e^(-x/reach)).

    Element j is a spring of stiffness torque/(reach n) that slips at _EDGES[j] reach; `stack` holds the stretches.
    """
    total = 0.0
    for j in range(ELEMENTS):
        stretch = min(max(stack[j] + move, -_EDGES[j] * reach), _EDGES[j] * reach)
        stack[j] = stretch
        total += stretch
    return total * torque / (reach * ELEMENTS)


@numba.njit(cache=True, error_model="numpy")
def turn_by_friction(before: float, v: float, impulse_up: float, impulse_down: float) -> float:
    """Speed left after a friction of impulse · tanh(v / TURN) at the mean of the speeds before and after.

    Taken at the speed that it leaves, it made the efforts of a stiff rigid joint a tenth of their noise wrong, in which
    a drift that nobody put there was found.
    """
    low, high = v - impulse_up, v + impulse_down
    for _ in range(60):
        left = 0.5 * (low + high)
        turn = math.tanh(0.5 * (before + left) / TURN)
        if left + turn * (impulse_up if turn > 0.0 else impulse_down) < v:
            low = left
        else:
            high = left
    return low


@numba.njit(cache=True, error_model="numpy")
def stop_by_friction(before: float, v: float, impulse_up: float, impulse_down: float, smooth: bool) -> float:
    """Speed left after dry friction has taken at most its impulse (per inertia) in either direction of motion.

    A sudden one turns when the motion does, within the step that led from `before` to `v`: turned with the step it
    would take up to twice its impulse too much at each reversal, which two hundred of them show as a friction that
    nobody put there.
    """
    if smooth and min(impulse_up, impulse_down) > 0.0:
        left: float = turn_by_friction(before, v, impulse_up, impulse_down)
        return left
    slowed = v - math.copysign(impulse_up if before > 0.0 else impulse_down, before)
    if before * slowed < 0.0:
        rest = slowed / (slowed - before)
        v, impulse_up, impulse_down = rest * (v - before), rest * impulse_up, rest * impulse_down
    if v > impulse_up:
        return v - impulse_up
    if v < -impulse_down:
        return v + impulse_down
    return 0.0


@numba.njit(cache=True, error_model="numpy")
def dry_level(v: float, coulomb: float, excess: float, speed: float, more: float, heavy: bool) -> tuple[float, float]:
    """Friction level against motion up and down; `heavy` swaps the Gaussian Stribeck curve for a Lorentzian one."""
    level = coulomb
    if excess != 0.0:
        x = v / speed
        level += excess / (1.0 + x * x) if heavy else excess * math.exp(-x * x)
    return level + more, level - more


@numba.njit(cache=True, error_model="numpy")
def drive_torque(
    p: Array, plant: Array, s: Array, stack: Array, h: float, drive: float, since: float, linear: bool
) -> float:
    """Torque of the motor at the output, `since` seconds after the torque constant began to drift.

    In `linear` iron, what saturates falls off in proportion to the current (Fröhlich).
    """
    q = plant[1] * s[XM]
    kt = plant[5] * p[KT, 0] * (1.0 + p[DRIFT, 0] * since)
    if p[DEMAG, 0] != 0.0:
        kt *= 1.0 - p[DEMAG, 0] * s[HEAT] / (s[HEAT] + p[DEMAG, 1])
    if p[SATURATION, 0] > 0.0:
        share = abs(drive) / p[SATURATION, 0]
        kt /= 1.0 + share if linear else math.sqrt(1.0 + share * share)
    if p[RIPPLE, 0] != 0.0:
        kt *= 1.0 + p[RIPPLE, 0] * math.sin(p[RIPPLE, 1] * q + p[RIPPLE, 2])
    torque: float = kt * plant[1] * drive
    if p[COG, 0] != 0.0:
        torque += p[COG, 0] * math.sin(p[COG, 1] * q + p[COG, 2])
    if p[SLIP, 0] != 0.0:  # a wave generator that slips in bursts when its load changes quickly
        s[LAG] += h * (torque - s[LAG]) / p[SLIP, 1]
        burst = (torque - s[LAG]) / p[SLIP, 2]
        torque -= p[SLIP, 0] * math.tanh(burst) * burst * burst / (1.0 + burst * burst)
    if p[PRESLIDE_M, 0] > 0.0:
        torque -= slide(stack, h * s[VM], p[PRESLIDE_M, 0], p[PRESLIDE_M, 0] / p[PRESLIDE_M, 1])
    return torque


@numba.njit(cache=True, error_model="numpy")
def link_torque(p: Array, s: Array, stack: Array, h: float, push: float, hard: bool) -> float:
    """Torque on the link from everything but the gearbox, whose harness may harden; moves the appendage's speed."""
    bend = s[XL] - p[HARNESS, 1]
    torque: float = push - p[LOAD, 0] - p[HARNESS, 0] * bend * (1.0 + HARDER * bend * bend if hard else 1.0)
    if p[GRAVITY, 0] != 0.0:
        torque -= p[GRAVITY, 0] * math.sin(s[XL] - p[GRAVITY, 1])
    if p[STOP, 1] != 0.0:
        past = s[XL] - p[STOP, 0]
        if past * p[STOP, 0] > 0.0:
            torque -= p[STOP, 1] * past
    if p[MODE, 0] > 0.0:
        omega = 2.0 * math.pi * p[MODE, 1]
        pull = p[MODE, 0] * (omega * omega * (s[XA] - s[XL]) + 2.0 * p[MODE, 2] * omega * (s[VA] - s[VL]))
        torque += pull
        s[VA] -= h * pull / p[MODE, 0]
    if p[PRESLIDE_L, 0] > 0.0:
        torque -= slide(stack, h * s[VL], p[PRESLIDE_L, 0], p[PRESLIDE_L, 0] / p[PRESLIDE_L, 1])
    return torque


@numba.njit(cache=True, error_model="numpy")
def gear_torque(p: Array, plant: Array, s: Array, stack: Array, h: float, lossy: bool) -> tuple[float, float]:
    """Torque in the gearbox, and the lever by which it acts on the motor (1 but for transmission error)."""
    twist, lever = s[XL] - s[XM], 1.0
    if p[MESH, 0] != 0.0:
        turn = p[MESH, 1] * plant[1] * s[XM] + p[MESH, 2]
        twist -= p[MESH, 0] * math.sin(turn)
        lever += p[MESH, 0] * p[MESH, 1] * plant[1] * math.cos(turn)
    if p[BACKLASH, 0] > 0.0:
        twist = twist - min(max(twist, -p[BACKLASH, 0]), p[BACKLASH, 0])
    torque = plant[3] * p[STIFFNESS, 0] * twist * (1.0 + p[STIFFENING, 0] * twist * twist)
    if lossy and p[BACKLASH, 0] > 0.0 and twist != 0.0:  # flanks that lose energy as they meet (Hunt-Crossley)
        loss = min(max(0.5 * (s[VL] - s[VM]) * (1.0 if twist > 0.0 else -1.0) / 1e-3, -0.3), 0.3)
        torque *= 1.0 + loss * p[BACKLASH, 0] / (p[BACKLASH, 0] + abs(twist))  # none where there is no play
    if p[HYSTERESIS, 0] > 0.0:
        torque += slide(stack, h * (s[VL] - s[VM]), p[HYSTERESIS, 0], p[HYSTERESIS, 1])
    if p[CREEP, 0] > 0.0:  # a Maxwell arm: stress that relaxes
        s[LAG] += h * (p[CREEP, 0] * (s[VL] - s[VM]) - s[LAG] / p[CREEP, 1])
        torque += s[LAG]
    return torque, lever


@numba.njit(cache=True, error_model="numpy")
def dampers(p: Array, plant: Array, s: Array, temperature: float, steep: bool) -> tuple[float, float]:
    """Viscous coefficients of motor and link; a `steep` one goes by the exponential of the temperature."""
    motor = p[VISCOUS_M, 0] + p[QUADRATIC, 0] * abs(s[VM])
    if p[TEMP_FRICTION, 0] != 0.0:
        warmth = p[TEMP_FRICTION, 1] * (temperature - 20.0)
        motor += p[TEMP_FRICTION, 0] * (math.exp(warmth) if steep else 1.0 + warmth)
    if p[ASYM_M, 1] != 0.0:
        motor += 0.5 * p[ASYM_M, 1] * (1.0 if s[VM] > 0.0 else -1.0)
    link = plant[4] + p[VISCOUS_L, 0]
    if p[ASYM_L, 1] != 0.0:
        link += 0.5 * p[ASYM_L, 1] * (1.0 if s[VL] > 0.0 else -1.0)
    return motor, link


@numba.njit(cache=True, error_model="numpy")
def motor_level(p: Array, s: Array, load: float, drag: float) -> float:
    """Dry friction of the motor side that depends on load, place, speed and the world outside."""
    level: float = p[COULOMB_M, 0] + p[LOAD_FRICTION, 0] * load + drag
    if p[BUMP, 0] > 0.0:
        where = (s[XL] - p[BUMP, 1]) / p[BUMP, 2]
        level += p[BUMP, 0] * math.exp(-0.5 * where * where)
    if p[THINNING, 0] > 0.0:
        level += p[THINNING, 0] * -math.expm1(-abs(s[VM]) / p[THINNING, 1])
    if p[SECTOR, 0] > 0.0 and s[VM] * (math.sin(p[SECTOR, 1] * s[XL]) - p[SECTOR, 2]) > 0.0:
        level += p[SECTOR, 0]  # a pawl: drags only one way, and that way depends on the sector
    return level


@numba.njit(cache=True, error_model="numpy")
def coast(s: Array, h: float) -> None:
    """Let everything move on for half a step."""
    s[XM] += 0.5 * h * s[VM]
    s[XL] += 0.5 * h * s[VL]
    s[XA] += 0.5 * h * s[VA]


@numba.njit(cache=True, error_model="numpy")
def kick_rigid(s: Array, h: float, j: float, force: float, d: float, up: float, down: float, smooth: bool) -> None:
    """Change the speed of the joint that is one body."""
    v = ((j - 0.5 * h * d) * s[VM] + h * force) / (j + 0.5 * h * d)
    s[VM] = stop_by_friction(s[VM], v, h * up / j, h * down / j, smooth)
    s[VL] = s[VM]


@numba.njit(cache=True, error_model="numpy")
def kick_flexible(
    s: Array, h: float, jm: float, jl: float, fm: float, fl: float, dm: float, dl: float, dg: float
) -> tuple[float, float]:
    """Give the speeds of motor and link after forces and dampers (implicit midpoint), dry friction still to come."""
    am, al, g = jm + 0.5 * h * (dm + dg), jl + 0.5 * h * (dl + dg), 0.5 * h * dg
    bm = jm * s[VM] + h * fm - 0.5 * h * (dm * s[VM] + dg * (s[VM] - s[VL]))
    bl = jl * s[VL] + h * fl - 0.5 * h * (dl * s[VL] + dg * (s[VL] - s[VM]))
    det = am * al - g * g
    return (al * bm + g * bl) / det, (am * bl + g * bm) / det


@numba.njit(cache=True, error_model="numpy")
def move(
    p: Array,
    plant: Array,
    s: Array,
    stacks: tuple[Array, Array, Array],
    h: float,
    drive: float,
    since: float,
    push: float,
    drag: float,
    temperature: float,
    jm: float,
    jl: float,
    variant: int,
    smooth: bool,
    rigid: bool,
) -> None:
    """Move the joint through one step: half a coast, the change of speed, half a coast (position Verlet)."""
    s[HEAT] += h * (drive * drive - s[HEAT]) / 20.0
    coast(s, h)
    fm = drive_torque(p, plant, s, stacks[0], h, drive, since, variant == 4)
    fl = link_torque(p, s, stacks[1], h, push, variant == 5)
    load = abs(fm)
    if not rigid:
        spring, lever = gear_torque(p, plant, s, stacks[2], h, variant == 2)
        load = abs(spring)
        fm += spring * lever
        fl -= spring
    dm, dl = dampers(p, plant, s, temperature, variant == 6)
    if p[PAYLOAD, 0] != 0.0:  # inertia that changes with the angle, with its centrifugal torque
        turn = p[PAYLOAD, 1] * (s[XL] - p[PAYLOAD, 2])
        fl -= 0.5 * jl * p[PAYLOAD, 0] * p[PAYLOAD, 1] * math.cos(turn) * s[VL] * s[VL]
        jl *= 1.0 + p[PAYLOAD, 0] * math.sin(turn)
    heavy, level = variant == 1, motor_level(p, s, load, drag)
    up_m, down_m = dry_level(s[VM], level, p[STRIBECK_M, 0], p[STRIBECK_M, 1], 0.5 * p[ASYM_M, 0], heavy)
    up_l, down_l = dry_level(s[VL], p[COULOMB_L, 0], p[STRIBECK_L, 0], p[STRIBECK_L, 1], 0.5 * p[ASYM_L, 0], heavy)
    if rigid:
        kick_rigid(s, h, jl + jm, fm + fl, dm + dl, up_m + up_l, down_m + down_l, smooth)
    else:
        vm, vl = kick_flexible(s, h, jm, jl, fm, fl, dm, dl, p[GEAR_DAMPING, 0])
        s[VM] = stop_by_friction(s[VM], vm, h * up_m / jm, h * down_m / jm, smooth)
        s[VL] = stop_by_friction(s[VL], vl, h * up_l / jl, h * down_l / jl, smooth)
    coast(s, h)
