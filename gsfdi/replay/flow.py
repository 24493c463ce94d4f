"""The linear joint under constant torques, advanced exactly by the matrix exponential."""

from gsfdi.replay import layout as at
from gsfdi.replay.compiling import compiled, inlined

TAYLOR = 14
"""Terms of the exponential's series: exact to rounding for arguments below one half."""


@compiled
def series(model, era, powers):  # type: ignore[no-untyped-def]
    """Fill ``powers[k] = A^k / k!`` for the plant of the era that begins at index `era` of the model."""
    matrix = powers[TAYLOR + 1]  # spare room
    for i in range(4):
        for j in range(4):
            matrix[i, j] = 0.0
    drag = model[era + at.DAMPING] / model[era + at.INERTIA_OUTPUT]
    matrix[0, 1] = 1.0
    if model[at.RIGID] > 0:
        matrix[1, 1] = -drag
    else:
        on_motor = model[era + at.SPRING_RATE] / model[era + at.INERTIA_MOTOR]
        matrix[1, 2], matrix[2, 3] = on_motor, 1.0
        matrix[3, 1], matrix[3, 3] = -drag, -drag
        matrix[3, 2] = -on_motor - model[era + at.SPRING_RATE] / model[era + at.INERTIA_OUTPUT]
    for k in range(TAYLOR + 1):
        for i in range(4):
            for j in range(4):
                value = 1.0 if k == 0 and i == j else 0.0
                for n in range(4 if k > 0 else 0):
                    value += powers[k - 1, i, n] * matrix[n, j]
                powers[k, i, j] = value / max(k, 1)


@compiled
def transition(model, era, powers, h, flow, which):  # type: ignore[no-untyped-def]
    """Fill ``flow[which] = [Φ(h), Γ(h)]`` (4, 6) by Horner's rule over the series."""
    for i in range(4):
        held_motor, held_output = 0.0, 0.0
        for j in range(4):
            phi, held = powers[TAYLOR, i, j], powers[TAYLOR, i, j] / (TAYLOR + 1)
            for k in range(TAYLOR - 1, -1, -1):
                phi = phi * h + powers[k, i, j]
                held = held * h + powers[k, i, j] / (k + 1)
            flow[which, i, j] = phi
            if j == 1:
                held_motor = held * h
            elif j == 3:
                held_output = held * h
        if model[at.RIGID] > 0:
            flow[which, i, 4] = held_motor / model[era + at.INERTIA_OUTPUT]
            flow[which, i, 5] = flow[which, i, 4]
        else:
            flow[which, i, 4] = (held_motor - held_output) / model[era + at.INERTIA_MOTOR]
            flow[which, i, 5] = held_output / model[era + at.INERTIA_OUTPUT]


@inlined
def advance(flow, which, v, source, target, on_motor, on_output):  # type: ignore[no-untyped-def]
    """Set row `target` of the vectors to ``Φ x + Γ w`` of row `source`."""
    a, b, c, d = v[source, 0], v[source, 1], v[source, 2], v[source, 3]
    for i in range(4):
        v[target, i] = (
            flow[which, i, 0] * a
            + flow[which, i, 1] * b
            + flow[which, i, 2] * c
            + flow[which, i, 3] * d
            + flow[which, i, 4] * on_motor
            + flow[which, i, 5] * on_output
        )
