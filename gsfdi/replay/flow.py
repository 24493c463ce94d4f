"""The linear joint under constant torques, advanced exactly by the matrix exponential."""

from gsfdi.replay import layout as at
from gsfdi.replay.compiling import compiled, inlined

TAYLOR = 12
"""Terms of the exponential's series: exact to rounding for arguments below one quarter."""
SHARES = tuple(1.0 / (k + 1) for k in range(TAYLOR + 1))
"""What the integral of each term is of it, times the step."""


@compiled
def series(model, era, spring, powers):  # type: ignore[no-untyped-def]
    """Fill ``powers[k] = A^k / k!`` for the plant of the era that begins at index `era`, of the `spring` given."""
    matrix = powers[TAYLOR + 1]  # spare room
    for i in range(4):
        for j in range(4):
            matrix[i, j] = 0.0
    drag = model[era + at.DAMPING] / model[era + at.INERTIA_OUTPUT]
    matrix[0, 1] = 1.0
    if model[at.RIGID] > 0:
        matrix[1, 1] = -drag
    else:
        on_motor = spring / model[era + at.INERTIA_MOTOR]
        matrix[1, 2], matrix[2, 3] = on_motor, 1.0
        matrix[3, 1], matrix[3, 3] = -drag, -drag
        matrix[3, 2] = -on_motor - spring / model[era + at.INERTIA_OUTPUT]
    for k in range(TAYLOR + 1):
        for i in range(4):
            for j in range(4):
                value = 1.0 if k == 0 and i == j else 0.0
                for n in range(4 if k > 0 else 0):
                    value += powers[k - 1, i, n] * matrix[n, j]
                powers[k, i, j] = value / max(k, 1)


@compiled
def transitions(model, era, powers, half, flow, first):  # type: ignore[no-untyped-def]
    """Fill ``flow[first] = [Φ(h/2), Γ(h/2)]`` (4, 6) by Horner's rule over the series, the next with those of h."""
    next_one = first + 1
    for i in range(4):
        b, c, d, held_motor, held_output = 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(TAYLOR, -1, -1):  # five sums side by side, none of which waits for another
            b = b * half + powers[k, i, 1]
            c = c * half + powers[k, i, 2]
            d = d * half + powers[k, i, 3]
            held_motor = held_motor * half + powers[k, i, 1] * SHARES[k]
            held_output = held_output * half + powers[k, i, 3] * SHARES[k]
        flow[first, i, 0] = 1.0 if i == 0 else 0.0  # A has nothing in its first column
        flow[first, i, 1], flow[first, i, 2], flow[first, i, 3] = b, c, d
        held_motor, held_output = held_motor * half, held_output * half
        if model[at.RIGID] > 0:
            flow[first, i, 4] = held_motor / model[era + at.INERTIA_OUTPUT]
            flow[first, i, 5] = flow[first, i, 4]
        else:
            flow[first, i, 4] = (held_motor - held_output) / model[era + at.INERTIA_MOTOR]
            flow[first, i, 5] = held_output / model[era + at.INERTIA_OUTPUT]
    for i in range(4):
        for j in range(6):
            twice = flow[first, i, j] if j > 3 else 0.0
            for n in range(4):
                twice += flow[first, i, n] * flow[first, n, j]
            flow[next_one, i, j] = twice


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
