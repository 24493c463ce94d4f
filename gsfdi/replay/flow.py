"""The linear joint under constant torques, advanced exactly by the matrix exponential."""

import math

from gsfdi.replay import layout as at
from gsfdi.replay.compiling import compiled, inlined

TERMS = 14
"""Terms of each series: exact to rounding for arguments below one quarter; see `enough`."""
LATER, NUMBERS, MATRICES = 3, 3 + TERMS, 4 + TERMS
"""Places among the matrices of the series and of the plant's own numbers, and how many there are."""


@compiled
def series(model, era, spring, powers):  # type: ignore[no-untyped-def]
    """Fill what `transitions` needs of the plant of the era that begins at index `era`, of the `spring` given.

    As A⁴ is -(a A³ + b A² + c A) (Cayley and Hamilton), the exponential's integral over h is h + u A + v A² + w A³.
    ``powers[:3]`` are A, A² and A³; ``powers[LATER + k, 0, :3]`` is what h^(k + 2) adds to u, v and w, and
    ``powers[NUMBERS, 0]`` is c, b, a and the plant's fastest rate.
    """
    powers[:LATER] = 0.0
    drag, on_motor, on_both = model[era + at.DAMPING] / model[era + at.INERTIA_OUTPUT], 0.0, 0.0
    powers[0, 0, 1], powers[0, 1, 1] = 1.0, -drag
    if model[at.RIGID] == 0:
        on_motor = spring / model[era + at.INERTIA_MOTOR]
        on_both = on_motor + spring / model[era + at.INERTIA_OUTPUT]
        powers[0, 1, 1], powers[0, 1, 2], powers[0, 2, 3] = 0.0, on_motor, 1.0
        powers[0, 3, 1], powers[0, 3, 2], powers[0, 3, 3] = -drag, -on_both, -drag
    for n in range(1, LATER):
        for i in range(4):
            for j in range(4):
                for k in range(4):
                    powers[n, i, j] += powers[n - 1, i, k] * powers[0, k, j]
    c, b, a = drag * on_motor, on_both, drag
    u, v, w, share = 1.0, 0.0, 0.0, 0.5
    for k in range(TERMS):
        powers[LATER + k, 0, 0], powers[LATER + k, 0, 1], powers[LATER + k, 0, 2] = u * share, v * share, w * share
        u, v, w, share = -c * w, u - b * w, v - a * w, share / (k + 3)
    numbers = powers[NUMBERS, 0]
    numbers[0], numbers[1], numbers[2], numbers[3] = c, b, a, max(math.sqrt(on_both), drag)


@compiled
def enough(argument):  # type: ignore[no-untyped-def]
    """Terms after which a series of that argument no longer changes."""
    if argument < 0.03:
        return 5 if argument < 1e-3 else 8
    return 11 if argument < 0.15 else TERMS


@compiled
def transitions(model, era, powers, half, flow, first):  # type: ignore[no-untyped-def]
    """Fill ``flow[first] = [Φ(h/2), Γ(h/2)]`` (4, 6), the next with those of h."""
    numbers = powers[NUMBERS, 0]
    c, b, a, rate = numbers[0], numbers[1], numbers[2], numbers[3]
    u, v, w = 0.0, 0.0, 0.0
    for k in range(enough(rate * half) - 1, -1, -1):  # three sums side by side: none waits for another
        u = u * half + powers[LATER + k, 0, 0]
        v = v * half + powers[LATER + k, 0, 1]
        w = w * half + powers[LATER + k, 0, 2]
    u, v, w = u * half**2, v * half**2, w * half**2
    flow_of(model, era, powers, half, u, v, w, flow, first)
    p, q, r = half - c * w, u - b * w, v - a * w  # what Φ has of A, A² and A³; times the integral it has up to A⁶
    sixth = r * w
    fifth = q * w + r * v - a * sixth
    fourth = p * w + q * v + r * u - b * sixth - a * fifth
    third = w + p * v + q * u + r * half - c * sixth - b * fifth - a * fourth
    second = v + p * u + q * half - c * fifth - b * fourth
    flow_of(model, era, powers, 2 * half, 2 * u + p * half - c * fourth, v + second, w + third, flow, first + 1)


@compiled
def flow_of(model, era, powers, h, u, v, w, flow, row):  # type: ignore[no-untyped-def]
    """Fill ``flow[row]`` with Φ(h) and Γ(h), the exponential's integral being h + u A + v A² + w A³."""
    numbers = powers[NUMBERS, 0]
    p, q, r = h - numbers[0] * w, u - numbers[1] * w, v - numbers[2] * w
    rigid, per_output = model[at.RIGID] > 0, 1.0 / model[era + at.INERTIA_OUTPUT]
    per_motor = 0.0 if rigid else 1.0 / model[era + at.INERTIA_MOTOR]
    for i in range(2 if rigid else 4):  # a rigid joint has no wind-up
        flow[row, i, 0] = 1.0 if i == 0 else 0.0  # A has nothing in its first column
        for j in range(1, 4):
            own = 1.0 if i == j else 0.0
            flow[row, i, j] = own + p * powers[0, i, j] + q * powers[1, i, j] + r * powers[2, i, j]
        on_motor = (h if i == 1 else 0.0) + u * powers[0, i, 1] + v * powers[1, i, 1] + w * powers[2, i, 1]
        on_output = (h if i == 3 else 0.0) + u * powers[0, i, 3] + v * powers[1, i, 3] + w * powers[2, i, 3]
        flow[row, i, 4] = on_motor * per_output if rigid else (on_motor - on_output) * per_motor
        flow[row, i, 5] = on_motor * per_output if rigid else on_output * per_output


@inlined
def advance(model, flow, which, v, source, target, on_motor, on_output):  # type: ignore[no-untyped-def]
    """Set row `target` of the vectors to ``Φ x + Γ w`` of row `source`."""
    a, b, c, d = v[source, 0], v[source, 1], v[source, 2], v[source, 3]
    flexible = model[at.RIGID] == 0
    for i in range(4):
        if i < 2 or flexible:
            v[target, i] = (
                flow[which, i, 0] * a
                + flow[which, i, 1] * b
                + flow[which, i, 2] * c
                + flow[which, i, 3] * d
                + flow[which, i, 4] * on_motor
                + flow[which, i, 5] * on_output
            )
