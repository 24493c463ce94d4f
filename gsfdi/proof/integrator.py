"""The proof's own simulator, which shares neither code nor way of writing with the other one.

Sensors and controller tick as the recording does; between the ticks motor and link (one body, if the joint is rigid)
move in short steps under the laws of `mechanics`.
"""

import math

import numba
import numpy as np

from gsfdi.proof.effects import (
    DELAY,
    DRIFT,
    ECCENTRIC,
    I_BIAS,
    I_GAIN,
    JL,
    JM,
    KT,
    LIMIT,
    STEP,
    STIFFNESS,
    W_BIAS,
    W_GAIN,
    Y_BIAS,
    Y_GAIN,
)
from gsfdi.proof.mechanics import ELEMENTS, VL, VM, XA, XL, XM, move
from gsfdi.types import Array

PLANT = ("motor_inertia", "gear_ratio", "output_inertia", "stiffness", "damping", "torque_constant")
LAW = ("proportional", "integral", "derivative", "rate_feedforward", "limit")


@numba.njit(cache=True, error_model="numpy")
def rounded(value: float, grain: float) -> float:
    """Round to a multiple of the grain, if there is one."""
    return round(value / grain) * grain if grain > 0.0 else value


@numba.njit(cache=True, error_model="numpy")
def sense(p: Array, plant: Array, s: Array, noise: Array, resolution: Array) -> tuple[float, float]:
    """Measure joint angle and motor speed."""
    y = p[Y_GAIN, 0] * s[XL] + p[Y_BIAS, 0] + noise[0]
    if p[ECCENTRIC, 0] != 0.0:
        y += p[ECCENTRIC, 0] * math.sin(p[ECCENTRIC, 1] * s[XL] + p[ECCENTRIC, 2])
    w = p[W_GAIN, 0] * plant[1] * s[VM] + p[W_BIAS, 0] + noise[1]
    return rounded(y, max(resolution[0], p[STEP, 0])), rounded(w, resolution[1])


@numba.njit(cache=True, error_model="numpy")
def arriving(t: Array, sent: Array, k: int, place: int, now: float, h: float, delay: float) -> tuple[int, float]:
    """Mean over the step of the late command that acts in it, and the tick that sent it (searched from `place` on)."""
    old = sent[place - 1] if place > 0 else 0.0
    while place < k and t[place + 1] <= now + h - delay:
        old = sent[place]
        place += 1
    share = min(max((now + h - delay - t[place]) / h, 0.0), 1.0)
    return place, share * sent[place] + (1.0 - share) * old


@numba.njit(cache=True, nogil=True, error_model="numpy")
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
    smooth: bool,
    rigid: bool,
    step: float,
) -> Array:
    """Run the joint under its controller, one tick per entry of `t`.

    `outside` (n, 2) holds torque and extra dry friction from elsewhere, `noise` (n, 3) that of position, motor
    velocity and effort as the sensors see it, `effects` (slots, 4) the size of every effect and `onsets` when each
    sets in. Returns a column each of position, motor velocity and effort as measured, then of wind-up, motor angle,
    joint velocity and command as they were.
    """
    n = t.size
    out, sent = np.empty((n, 7)), np.zeros(n)
    idle = np.zeros(effects.shape)
    for ratio in (KT, JM, STIFFNESS, JL, Y_GAIN, W_GAIN, I_GAIN):
        idle[ratio, 0] = 1.0
    p, s, stacks = idle.copy(), np.zeros(8), (np.zeros(ELEMENTS), np.zeros(ELEMENTS), np.zeros(ELEMENTS))
    s[XM] = s[XL] = s[XA] = setpoint[0]
    integral, before, place = 0.0, 0.0, 0
    for k in range(n):
        for row in range(effects.shape[0]):
            p[row] = effects[row] if t[k] >= onsets[row] else idle[row]
        y, w = sense(p, plant, s, noise[k], resolution)
        error = setpoint[k] - y
        pending = integral + (0.5 * (error + before) * (t[k] - t[k - 1]) if k > 0 else 0.0)
        command = law[0] * error + law[1] * pending + law[2] * (law[3] * rate[k] - w / plant[1]) + feedforward[k]
        limit = min(law[4], p[LIMIT, 0]) if p[LIMIT, 0] > 0.0 else law[4]
        sent[k] = min(max(command, -limit), limit)
        if sent[k] == command:  # the integral rests while the command is clipped
            integral = pending
        before = error
        out[k, 0], out[k, 1] = y, w
        out[k, 2] = rounded(p[I_GAIN, 0] * sent[k] + p[I_BIAS, 0] + noise[k, 2], resolution[2])
        out[k, 3], out[k, 4], out[k, 5], out[k, 6] = s[XL] - s[XM], s[XM], s[VL], sent[k]
        if k == n - 1:
            break
        jm, jl = plant[0] * plant[1] * plant[1] * p[JM, 0], plant[2] * p[JL, 0]
        count = max(1, math.ceil((t[k + 1] - t[k]) / step - 1e-9))
        h = (t[k + 1] - t[k]) / count
        since, push, drag = max(0.0, t[k] - onsets[DRIFT]), outside[k, 0], outside[k, 1]
        for sub in range(count):
            drive = sent[k]
            if p[DELAY, 0] > 0.0:
                place, drive = arriving(t, sent, k, place, t[k] + sub * h, h, p[DELAY, 0])
            move(p, plant, s, stacks, h, drive, since, push, drag, temperature[k], jm, jl, variant, smooth, rigid)
    return out
