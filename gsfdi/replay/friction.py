"""Dry friction over a step: sliding at its level, or sticking exactly."""

from gsfdi import motion
from gsfdi.replay import layout as at
from gsfdi.replay.compiling import compiled, inlined
from gsfdi.replay.laws import total

SLIDES, TURNS, STICKS = range(3)  # over a step; STICKS to its end, after a slide or not; TURNS round or begins to slide


@compiled
def dry_over(before, after, response, low, high):  # type: ignore[no-untyped-def]
    """Mean over a step of a dry friction in [low, high], how far it acts before its mean, what it did, and its slide.

    The speed is `before` the step, and would be `after` it without friction, of which each unit takes away `response`.
    Friction slides at its bound until the speed is zero; for what then remains of the step it is the torque within its
    bounds that leaves the least speed at the end. Torque f₁ over a share s of the step and f₂ after it moves the angle
    further than their mean by (f₁ - f₂) s (1 - s) / 2 times what a unit of torque adds to the speed, times the step.
    What comes to rest and sticks has moved by half its speed over that share: the last number, per step.
    """
    first, share = 0.0, 0.0
    if before != 0.0:
        first = high if before > 0.0 else low
        end = after - response * first
        if end * before >= 0.0:
            return first, 0.0, SLIDES, 0.0
        share = before / (before - end)
    rest = 1.0 - share
    if rest <= 0.0:
        return first, 0.0, SLIDES, 0.0
    held = min(max((after - response * first * share) / (response * rest), low), high)
    did = STICKS if low < held < high else TURNS
    return first * share + held * rest, 0.5 * (first - held) * share * rest, did, 0.5 * before * share


@compiled
def dry_range(slot, model, m, states):  # type: ignore[no-untyped-def]
    """Least and greatest torque of the dry friction in `slot`."""
    m[motion.DIRECTION] = 1.0
    high = total(slot, model, m, states)
    low = -high
    if model[at.SIDED] > 0:
        m[motion.DIRECTION] = -1.0
        low = -total(slot, model, m, states)
    m[motion.DIRECTION] = 1.0 if m[motion.SPEED] >= 0 else -1.0
    return min(low, high), max(low, high)


@inlined
def stop_dry(flow, full, v, motor_low, motor_high, output_low, output_high):  # type: ignore[no-untyped-def]
    """Dry friction on motor and output that brings the speeds of the free motion nearest to zero.

    `full` is where the flow over the step stands in `flow`.

    Returns
    -------
    tuple of float
        Mean over the step on the motor and on the output, then how far each acts before its mean (see `dry_over`).
    tuple of int
        What either did.
    tuple of float
        How far either slid before it stuck.
    """
    on_motor, on_output, motor_early, output_early = 0.0, 0.0, 0.0, 0.0
    motor_did, output_did, motor_slid, output_slid = SLIDES, SLIDES, 0.0, 0.0
    if motor_low == 0.0 and motor_high == 0.0 and output_low == 0.0 and output_high == 0.0:
        return on_motor, on_output, motor_early, output_early, motor_did, output_did, motor_slid, output_slid
    for turn in range(3):
        was, speed = on_motor, v[at.FREE, 1] - flow[full, 5, 1] * on_output
        on_motor, motor_early, motor_did, motor_slid = dry_over(
            v[at.X, 1], speed, flow[full, 4, 1], motor_low, motor_high
        )
        if output_low == output_high == 0.0 or (turn > 0 and on_motor == was):
            break
        speed = v[at.FREE, 1] + v[at.FREE, 3] - (flow[full, 4, 1] + flow[full, 4, 3]) * on_motor
        response = flow[full, 5, 1] + flow[full, 5, 3]
        before = v[at.X, 1] + v[at.X, 3]
        on_output, output_early, output_did, output_slid = dry_over(before, speed, response, output_low, output_high)
    return on_motor, on_output, motor_early, output_early, motor_did, output_did, motor_slid, output_slid
