"""A wave over a step of the motion: its mean, and by how much it acts before that.

A replay holds torques at their mean over a step. For a wave that is off by what it does earlier or later within the
step, which its phase tells: half the step less the time gone by, times the wave, has the mean of `EARLY` times the
step. With that, substeps twice as long err by less in the root mean square. On a flexible joint that rubs, speeds erred
beside a cogging of a fifth of the drive's torque by 0.007 to 0.017 of their sensor's noise, before by 0.021; beside a
ripple by 0.008, before 0.010; beside an error of transmission by 0.013 and 0.020, before 0.039. Positions erred by more
in two of five, at most by 0.004 of their noise, and the worst sample of the speeds by 0.2 to 0.3, before 0.04 to 0.13.
"""

import math

from gsfdi.motion import EARLY, GEAR, MOTOR_TURN, SPEED, STEP, Vector

SHORT = 1e-3  # [rad] of phase over half a step below which its powers are lost in rounding


def half_phase(m: Vector, order: float) -> float:
    """Give the phase [rad] by which a wave of the motor angle changes over half a step."""
    return 0.5 * order * m[GEAR] * m[SPEED] * m[STEP]


def shrunk(half: float) -> float:
    """Give the mean of a wave over a step, as a share of what it is in the middle."""
    return math.sin(half) / half if abs(half) > SHORT else 1.0


def sine(m: Vector, size: float, order: float, phase: float) -> float:
    """Give the mean of size · sin(order φ + phase) over a step around the motor angle φ, and count how early it acts.

    Laws that are compiled may call it, and the two above (see `gsfdi.packed`); they have it frozen in, so that after a
    change here numba's caches must go, as after one in `gsfdi.motion`.
    """
    half, turn = half_phase(m, order), order * m[MOTOR_TURN] + phase
    mean = shrunk(half)
    lag = 0.5 * (mean - math.cos(half)) / half if abs(half) > SHORT else half / 6.0
    m[EARLY] -= size * lag * math.cos(turn)
    return size * mean * math.sin(turn)
