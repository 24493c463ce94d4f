"""The proof's own mechanics: a compiled integrator that shares neither code nor way of writing with the simulator.

Two bodies (motor and link, both in output angles) move by position Verlet. Dry friction is a set-valued impulse that
stops a body exactly where it would stick; presliding and gearbox hysteresis are stacks of Maxwell slip elements;
backlash is a gap between two contact flanks. Viscous losses are implicit midpoint. A rigid joint is both bodies as one.
"""

import math

import numba
import numpy as np

from gsfdi.types import Array

SLOTS = (
    "torque_constant_change",
    "torque_constant_drift",
    "torque_ripple",
    "cogging",
    "magnetic_saturation",
    "current_limit",
    "actuation_delay",
    "motor_inertia_change",
    "coulomb_motor",
    "coulomb_output",
    "viscous_motor",
    "viscous_output",
    "stribeck_motor",
    "stribeck_output",
    "presliding_motor",
    "presliding_output",
    "asymmetric_motor",
    "asymmetric_output",
    "load_dependent_friction",
    "temperature_dependent_friction",
    "position_dependent_friction",
    "quadratic_friction",
    "stiffness_change",
    "stiffening",
    "backlash",
    "gearbox_hysteresis",
    "gearbox_damping",
    "transmission_error",
    "output_inertia_change",
    "gravity_unbalance",
    "cable_harness",
    "structural_mode",
    "constant_load",
    "end_stop",
    "position_bias",
    "position_gain",
    "encoder_eccentricity",
    "velocity_gain",
    "velocity_bias",
    "current_gain",
    "current_bias",
    "quantisation",
    "demagnetisation",
    "gear_creep",
    "moving_payload",
    "sector_drag",
    "wave_generator_slip",
)
"""Rows of the table of effects; the last five are inventions that no shelf describes."""

SLOT = {name: row for row, name in enumerate(SLOTS)}
WIDTH = 4  # parameters per row
PLANT = ("motor_inertia", "gear_ratio", "output_inertia", "stiffness", "damping", "torque_constant")
LAW = ("proportional", "integral", "derivative", "rate_feedforward", "limit")
TRACES = ("position", "motor_velocity", "effort", "windup", "motor_angle", "joint_velocity", "command")

(
    KT,
    DRIFT,
    RIPPLE,
    COG,
    SATURATION,
    LIMIT,
    DELAY,
    JM,
    COULOMB_M,
    COULOMB_L,
    VISCOUS_M,
    VISCOUS_L,
    STRIBECK_M,
    STRIBECK_L,
    PRESLIDE_M,
    PRESLIDE_L,
    ASYM_M,
    ASYM_L,
    LOAD_FRICTION,
    TEMP_FRICTION,
    BUMP,
    QUADRATIC,
    STIFFNESS,
    STIFFENING,
    BACKLASH,
    HYSTERESIS,
    GEAR_DAMPING,
    MESH,
    JL,
    GRAVITY,
    HARNESS,
    MODE,
    LOAD,
    STOP,
    Y_BIAS,
    Y_GAIN,
    ECCENTRIC,
    W_GAIN,
    W_BIAS,
    I_GAIN,
    I_BIAS,
    STEP,
    DEMAG,
    CREEP,
    PAYLOAD,
    SECTOR,
    SLIP,
) = range(len(SLOTS))

ELEMENTS = 12  # slip elements in a stack; their yield points spread over the exponential virgin curve
_EDGES = -np.log(1.0 - (np.arange(ELEMENTS) + 0.5) / ELEMENTS)


@numba.njit(cache=True)
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


@numba.njit(cache=True)
def stop_by_friction(v: float, impulse_up: float, impulse_down: float) -> float:
    """Speed left after dry friction has taken at most its impulse (per inertia) in either direction of motion."""
    if v > impulse_up:
        return v - impulse_up
    if v < -impulse_down:
        return v + impulse_down
    return 0.0


@numba.njit(cache=True)
def dry_level(v: float, coulomb: float, excess: float, speed: float, more: float, heavy: bool) -> tuple[float, float]:
    """Friction level against motion up and down; `heavy` swaps the Gaussian Stribeck curve for a Lorentzian one."""
    level = coulomb
    if excess != 0.0:
        x = v / speed
        level += excess / (1.0 + x * x) if heavy else excess * math.exp(-x * x)
    return level + more, level - more


@numba.njit(cache=True, nogil=True)
def integrate(
    t: Array,
    setpoint: Array,
    rate: Array,
    feedforward: Array,
    temperature: Array,
    outside: Array,
    noise: Array,
    resolution: Array,
    plant: Array,
    law: Array,
    effects: Array,
    onsets: Array,
    variant: int,
    rigid: bool,
    step: float,
) -> Array:
    """Run the joint under its controller, one tick per entry of `t`.

    `outside` (n, 2) holds torque and extra dry friction from elsewhere, `noise` (n, 3) that of position, motor
    velocity and effort as the sensors see it, `effects` (slots, 4) the size of every effect and `onsets` when each
    sets in. Returns one column per name in `TRACES`: what was measured, then what was true.
    """
    n = t.size
    out = np.empty((n, 7))
    idle = np.zeros(effects.shape)
    for ratio in (KT, JM, STIFFNESS, JL, Y_GAIN, W_GAIN, I_GAIN):
        idle[ratio, 0] = 1.0
    p = idle.copy()
    gear, integral, before, held = plant[1], 0.0, 0.0, True
    xm = xl = setpoint[0]
    xa, va, vm, vl, heat, lag = setpoint[0], 0.0, 0.0, 0.0, 0.0, 0.0
    stack_m, stack_l, stack_g = np.zeros(ELEMENTS), np.zeros(ELEMENTS), np.zeros(ELEMENTS)
    sent, old = 0, 0.0
    for k in range(n):
        for row in range(effects.shape[0]):
            p[row] = effects[row] if t[k] >= onsets[row] else idle[row]
        # sensors
        true = xl if not rigid else xm
        y = p[Y_GAIN, 0] * true + p[Y_BIAS, 0] + noise[k, 0]
        if p[ECCENTRIC, 0] != 0.0:
            y += p[ECCENTRIC, 0] * math.sin(p[ECCENTRIC, 1] * true + p[ECCENTRIC, 2])
        grain = max(resolution[0], p[STEP, 0])
        if grain > 0.0:
            y = round(y / grain) * grain
        w = p[W_GAIN, 0] * gear * vm + p[W_BIAS, 0] + noise[k, 1]
        if resolution[1] > 0.0:
            w = round(w / resolution[1]) * resolution[1]
        # controller
        error = setpoint[k] - y
        pending = integral
        if k > 0:
            pending += 0.5 * (error + before) * (t[k] - t[k - 1])
        command = law[0] * error + law[1] * pending + law[2] * (law[3] * rate[k] - w / gear) + feedforward[k]
        limit = law[4]
        if p[LIMIT, 0] > 0.0:
            limit = min(limit, p[LIMIT, 0])
        clipped = min(max(command, -limit), limit)
        held = clipped != command
        if not held:
            integral = pending
        before = error
        current = p[I_GAIN, 0] * clipped + p[I_BIAS, 0] + noise[k, 2]
        if resolution[2] > 0.0:
            current = round(current / resolution[2]) * resolution[2]
        out[k, 0], out[k, 1], out[k, 2], out[k, 3] = y, w, current, xl - xm
        out[k, 4], out[k, 5], out[k, 6] = xm, vl if not rigid else vm, clipped
        if k == n - 1:
            break
        # mechanics until the next tick
        jm = plant[0] * gear * gear * p[JM, 0]
        jl0 = plant[2] * p[JL, 0]
        count = max(1, math.ceil((t[k + 1] - t[k]) / step - 1e-9))
        h = (t[k + 1] - t[k]) / count
        for sub in range(count):
            now = t[k] + sub * h
            drive = clipped
            if p[DELAY, 0] > 0.0:  # mean over the substep of the command that acts in it
                while sent < k and t[sent + 1] <= now + h - p[DELAY, 0]:
                    old = out[sent, 6]
                    sent += 1
                share = min(max((now + h - p[DELAY, 0] - t[sent]) / h, 0.0), 1.0)
                drive = share * out[sent, 6] + (1.0 - share) * old
            heat += h * (drive * drive - heat) / 20.0
            xm += 0.5 * h * vm
            xl += 0.5 * h * vl
            xa += 0.5 * h * va
            q = gear * xm
            kt = plant[5] * p[KT, 0] * (1.0 + p[DRIFT, 0] * max(0.0, t[k] - onsets[DRIFT]))
            kt *= 1.0 - p[DEMAG, 0] * heat / (heat + p[DEMAG, 1]) if p[DEMAG, 0] != 0.0 else 1.0
            if p[SATURATION, 0] > 0.0:
                kt /= math.sqrt(1.0 + (drive / p[SATURATION, 0]) ** 2)
            if p[RIPPLE, 0] != 0.0:
                kt *= 1.0 + p[RIPPLE, 0] * math.sin(p[RIPPLE, 1] * q + p[RIPPLE, 2])
            fm = kt * gear * drive
            load = abs(fm)
            if p[COG, 0] != 0.0:
                fm += p[COG, 0] * math.sin(p[COG, 1] * q + p[COG, 2])
            if p[SLIP, 0] != 0.0:  # a torque of the wind-up's own past: it bursts when the gear unloads quickly
                lag += h * (fm - lag) / p[SLIP, 1]
                burst = (fm - lag) / p[SLIP, 2]
                fm -= p[SLIP, 0] * math.tanh(burst) * burst * burst / (1.0 + burst * burst)
            fl = outside[k, 0] - p[LOAD, 0] - p[HARNESS, 0] * (xl - p[HARNESS, 1])
            if p[GRAVITY, 0] != 0.0:
                fl -= p[GRAVITY, 0] * math.sin(xl - p[GRAVITY, 1])
            if p[STOP, 1] != 0.0:
                past = xl - p[STOP, 0]
                if past * p[STOP, 0] > 0.0:
                    fl -= p[STOP, 1] * past
            if p[MODE, 0] > 0.0:
                omega = 2.0 * math.pi * p[MODE, 1]
                pull = p[MODE, 0] * (omega * omega * (xa - xl) + 2.0 * p[MODE, 2] * omega * (va - vl))
                fl += pull
                va -= h * pull / p[MODE, 0]
            if p[PRESLIDE_M, 0] > 0.0:
                fm -= slide(stack_m, h * vm, p[PRESLIDE_M, 0], p[PRESLIDE_M, 0] / p[PRESLIDE_M, 1])
            if p[PRESLIDE_L, 0] > 0.0:
                fl -= slide(stack_l, h * vl, p[PRESLIDE_L, 0], p[PRESLIDE_L, 0] / p[PRESLIDE_L, 1])
            gap_damping = p[GEAR_DAMPING, 0]
            if not rigid:
                twist, lever = xl - xm, 1.0
                if p[MESH, 0] != 0.0:
                    turn = p[MESH, 1] * q + p[MESH, 2]
                    twist -= p[MESH, 0] * math.sin(turn)
                    lever += p[MESH, 0] * p[MESH, 1] * gear * math.cos(turn)
                if p[BACKLASH, 0] > 0.0:
                    twist = twist - min(max(twist, -p[BACKLASH, 0]), p[BACKLASH, 0])
                spring = plant[3] * p[STIFFNESS, 0] * twist * (1.0 + p[STIFFENING, 0] * twist * twist)
                if variant == 2 and p[BACKLASH, 0] > 0.0 and twist != 0.0:  # flanks that lose energy (Hunt-Crossley)
                    spring *= 1.0 + min(max(0.5 * (vl - vm) * (1.0 if twist > 0.0 else -1.0) / 1e-3, -0.3), 0.3)
                if p[HYSTERESIS, 0] > 0.0:
                    spring += slide(stack_g, h * (vl - vm), p[HYSTERESIS, 0], p[HYSTERESIS, 1])
                if p[CREEP, 0] > 0.0:  # a Maxwell arm: stress that relaxes
                    lag += h * (p[CREEP, 0] * (vl - vm) - lag / p[CREEP, 1])
                    spring += lag
                load = abs(spring)
                fm += spring * lever
                fl -= spring
            dm = p[VISCOUS_M, 0] + p[QUADRATIC, 0] * abs(vm)
            if p[TEMP_FRICTION, 0] != 0.0:
                dm += p[TEMP_FRICTION, 0] * (1.0 + p[TEMP_FRICTION, 1] * (temperature[k] - 20.0))
            if p[ASYM_M, 1] != 0.0:
                dm += 0.5 * p[ASYM_M, 1] * (1.0 if vm > 0.0 else -1.0)
            dl = plant[4] + p[VISCOUS_L, 0]
            if p[ASYM_L, 1] != 0.0:
                dl += 0.5 * p[ASYM_L, 1] * (1.0 if vl > 0.0 else -1.0)
            jl = jl0
            if p[PAYLOAD, 0] != 0.0:  # inertia that changes with the angle, with its centrifugal torque
                turn = p[PAYLOAD, 1] * (xl - p[PAYLOAD, 2])
                jl *= 1.0 + p[PAYLOAD, 0] * math.sin(turn)
                fl -= 0.5 * jl0 * p[PAYLOAD, 0] * p[PAYLOAD, 1] * math.cos(turn) * vl * vl
            base = p[COULOMB_M, 0] + p[LOAD_FRICTION, 0] * load + outside[k, 1]
            if p[BUMP, 0] > 0.0:
                where = (xl - p[BUMP, 1]) / p[BUMP, 2]
                base += p[BUMP, 0] * math.exp(-0.5 * where * where)
            if p[SECTOR, 0] > 0.0 and vm * (math.sin(p[SECTOR, 1] * xl) - p[SECTOR, 2]) > 0.0:
                base += p[SECTOR, 0]  # a pawl: drags only one way, and that way depends on the sector
            heavy = variant == 1
            up_m, down_m = dry_level(vm, base, p[STRIBECK_M, 0], p[STRIBECK_M, 1], 0.5 * p[ASYM_M, 0], heavy)
            up_l, down_l = dry_level(vl, p[COULOMB_L, 0], p[STRIBECK_L, 0], p[STRIBECK_L, 1], 0.5 * p[ASYM_L, 0], heavy)
            if rigid:
                j = jl + jm
                d = dm + dl
                v = ((j - 0.5 * h * d) * vm + h * (fm + fl)) / (j + 0.5 * h * d)
                vm = stop_by_friction(v, h * (up_m + up_l) / j, h * (down_m + down_l) / j)
                vl = vm
                xm += 0.5 * h * vm
                xl = xm
            else:
                # implicit midpoint of the three dampers
                am, al, g = jm + 0.5 * h * (dm + gap_damping), jl + 0.5 * h * (dl + gap_damping), 0.5 * h * gap_damping
                bm = jm * vm + h * fm - 0.5 * h * (dm * vm + gap_damping * (vm - vl))
                bl = jl * vl + h * fl - 0.5 * h * (dl * vl + gap_damping * (vl - vm))
                det = am * al - g * g
                nm, nl = (al * bm + g * bl) / det, (am * bl + g * bm) / det
                vm = stop_by_friction(nm, h * up_m / jm, h * down_m / jm)
                vl = stop_by_friction(nl, h * up_l / jl, h * down_l / jl)
                xm += 0.5 * h * vm
                xl += 0.5 * h * vl
            xa += 0.5 * h * va
    return out
