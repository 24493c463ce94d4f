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
    ``powers[:3]`` are A, A² and A³, by column; ``powers[LATER + k, 0, :3]`` is what h^(k + 2) adds to u, v and w, and
    ``powers[NUMBERS, 0]`` is c, b, a and the plant's fastest rate, the next row one over each side's inertia.
    """
    powers[:LATER] = 0.0
    drag, on_motor, on_both = model[era + at.DAMPING] / model[era + at.INERTIA_OUTPUT], 0.0, 0.0
    powers[0, 1, 0], powers[0, 1, 1] = 1.0, -drag
    if model[at.RIGID] == 0:
        on_motor = spring / model[era + at.INERTIA_MOTOR]
        on_both = on_motor + spring / model[era + at.INERTIA_OUTPUT]
        powers[0, 1, 1], powers[0, 2, 1], powers[0, 3, 2] = 0.0, on_motor, 1.0
        powers[0, 1, 3], powers[0, 2, 3], powers[0, 3, 3] = -drag, -on_both, -drag
    for n in range(1, LATER):
        for j in range(4):
            for i in range(4):
                for k in range(4):
                    powers[n, j, i] += powers[n - 1, k, i] * powers[0, j, k]
    c, b, a = drag * on_motor, on_both, drag
    u, v, w, share = 1.0, 0.0, 0.0, 0.5
    for k in range(TERMS):
        powers[LATER + k, 0, 0], powers[LATER + k, 0, 1], powers[LATER + k, 0, 2] = u * share, v * share, w * share
        u, v, w, share = -c * w, u - b * w, v - a * w, share / (k + 3)
    numbers = powers[NUMBERS, 0]
    numbers[0], numbers[1], numbers[2], numbers[3] = c, b, a, max(math.sqrt(on_both), drag)
    lightness = powers[NUMBERS, 1]
    lightness[1] = 1.0 / model[era + at.INERTIA_OUTPUT]
    lightness[0] = lightness[1] if model[at.RIGID] > 0 else 1.0 / model[era + at.INERTIA_MOTOR]


@compiled
def enough(argument):  # type: ignore[no-untyped-def]
    """Terms, an even number, after which a series of that argument no longer changes."""
    if argument < 0.03:
        return 6 if argument < 1e-3 else 8
    return 12 if argument < 0.15 else TERMS


@compiled
def transitions(model, powers, half, flow, first):  # type: ignore[no-untyped-def]
    """Fill ``flow[first] = [Φ(h/2), Γ(h/2)]`` (6, 4), by column, the next with those of h."""
    numbers = powers[NUMBERS, 0]
    c, b, a, rate = numbers[0], numbers[1], numbers[2], numbers[3]
    u, v, w, odd_u, odd_v, odd_w, square = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, half * half
    for k in range(LATER + enough(rate * half) - 2, LATER - 1, -2):  # six sums side by side: none waits for another
        u, odd_u = u * square + powers[k, 0, 0], odd_u * square + powers[k + 1, 0, 0]
        v, odd_v = v * square + powers[k, 0, 1], odd_v * square + powers[k + 1, 0, 1]
        w, odd_w = w * square + powers[k, 0, 2], odd_w * square + powers[k + 1, 0, 2]
    u, v, w = (u + odd_u * half) * square, (v + odd_v * half) * square, (w + odd_w * half) * square
    flow_of(model, powers, half, u, v, w, flow, first)
    p, q, r = half - c * w, u - b * w, v - a * w  # what Φ has of A, A² and A³; times the integral it has up to A⁶
    sixth = r * w
    fifth = q * w + r * v - a * sixth
    fourth = p * w + q * v + r * u - b * sixth - a * fifth
    third = w + p * v + q * u + r * half - c * sixth - b * fifth - a * fourth
    second = v + p * u + q * half - c * fifth - b * fourth
    flow_of(model, powers, 2 * half, 2 * u + p * half - c * fourth, v + second, w + third, flow, first + 1)


@compiled
def flow_of(model, powers, h, u, v, w, flow, row):  # type: ignore[no-untyped-def]
    """Fill ``flow[row]`` with Φ(h) and Γ(h), by column, the exponential's integral being h + u A + v A² + w A³."""
    numbers = powers[NUMBERS, 0]
    p, q, r = h - numbers[0] * w, u - numbers[1] * w, v - numbers[2] * w
    lightness = powers[NUMBERS, 1]
    out, A, A2, A3 = flow[row], powers[0], powers[1], powers[2]
    out[0, 0], out[0, 1], out[0, 2], out[0, 3] = 1.0, 0.0, 0.0, 0.0  # A has nothing in its first column
    weigh(out[1], 0.0, 1.0, 0.0, 0.0, p, A[1], q, A2[1], r, A3[1])
    weigh(out[2], 0.0, 0.0, 1.0, 0.0, p, A[2], q, A2[2], r, A3[2])
    weigh(out[3], 0.0, 0.0, 0.0, 1.0, p, A[3], q, A2[3], r, A3[3])
    weigh(out[4], 0.0, h, 0.0, 0.0, u, A[1], v, A2[1], w, A3[1])
    if model[at.RIGID] > 0:
        for i in range(4):
            out[4, i] *= lightness[1]
            out[5, i] = out[4, i]
        return
    weigh(out[5], 0.0, 0.0, 0.0, h, u, A[3], v, A2[3], w, A3[3])
    for i in range(4):
        out[4, i] = (out[4, i] - out[5, i]) * lightness[0]
        out[5, i] *= lightness[1]


@inlined
def weigh(out, a, b, c, d, p, x, q, y, r, z):  # type: ignore[no-untyped-def]
    """Set `out` to ``(a, b, c, d) + p x + q y + r z``; nothing is written before all that may overlap it is read."""
    a, b = a + p * x[0] + q * y[0] + r * z[0], b + p * x[1] + q * y[1] + r * z[1]
    c, d = c + p * x[2] + q * y[2] + r * z[2], d + p * x[3] + q * y[3] + r * z[3]
    out[0], out[1], out[2], out[3] = a, b, c, d


@inlined
def advance(flow, which, v, source, target, on_motor, on_output):  # type: ignore[no-untyped-def]
    """Set row `target` of the vectors to ``Φ x + Γ w`` of row `source`."""
    a, b, c, d = v[source, 0], v[source, 1], v[source, 2], v[source, 3]
    by = flow[which]
    e = by[0, 0] * a + by[1, 0] * b + by[2, 0] * c + by[3, 0] * d + by[4, 0] * on_motor + by[5, 0] * on_output
    f = by[0, 1] * a + by[1, 1] * b + by[2, 1] * c + by[3, 1] * d + by[4, 1] * on_motor + by[5, 1] * on_output
    g = by[0, 2] * a + by[1, 2] * b + by[2, 2] * c + by[3, 2] * d + by[4, 2] * on_motor + by[5, 2] * on_output
    h = by[0, 3] * a + by[1, 3] * b + by[2, 3] * c + by[3, 3] * d + by[4, 3] * on_motor + by[5, 3] * on_output
    v[target, 0], v[target, 1], v[target, 2], v[target, 3] = e, f, g, h
