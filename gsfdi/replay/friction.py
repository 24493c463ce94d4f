"""Dry friction over a step: sliding at its level, or sticking exactly."""

from gsfdi import motion
from gsfdi.replay import layout as at
from gsfdi.replay.compiling import compiled, inlined
from gsfdi.replay.laws import total


@compiled
def dry_mean(before, after, response, low, high):  # type: ignore[no-untyped-def]
    """Mean over a step of a dry friction in [low, high].

    The speed is `before` the step, and would be `after` it without friction, of which each unit takes away `response`.
    Friction slides at its bound until the speed is zero; for what then remains of the step it is the torque within its
    bounds that leaves the least speed at the end.
    """
    first, share = 0.0, 0.0
    if before != 0.0:
        first = high if before > 0.0 else low
        end = after - response * first
        if end * before >= 0.0:
            return first
        share = before / (before - end)
    rest = 1.0 - share
    if rest <= 0.0:
        return first
    held = min(max((after - response * first * share) / (response * rest), low), high)
    return first * share + held * rest


@compiled
def dry_range(slot, model, m, states):  # type: ignore[no-untyped-def]
    """Least and greatest torque of the dry friction in `slot`."""
    m[motion.DIRECTION] = 1.0
    high = total(slot, model, m, states)
    m[motion.DIRECTION] = -1.0
    low = -total(slot, model, m, states)
    m[motion.DIRECTION] = 1.0 if m[motion.SPEED] >= 0 else -1.0
    return min(low, high), max(low, high)


@inlined
def stop_dry(flow, v, motor_low, motor_high, output_low, output_high):  # type: ignore[no-untyped-def]
    """Dry friction on motor and output that brings the speeds of the free motion nearest to zero."""
    on_motor, on_output = 0.0, 0.0
    if motor_low == 0.0 and motor_high == 0.0 and output_low == 0.0 and output_high == 0.0:
        return on_motor, on_output
    for _ in range(3):
        speed = v[at.FREE, 1] - flow[1, 1, 5] * on_output
        on_motor = dry_mean(v[at.X, 1], speed, flow[1, 1, 4], motor_low, motor_high)
        if output_low == 0.0 and output_high == 0.0:
            break
        speed = v[at.FREE, 1] + v[at.FREE, 3] - (flow[1, 1, 4] + flow[1, 3, 4]) * on_motor
        on_output = dry_mean(v[at.X, 1] + v[at.X, 3], speed, flow[1, 1, 5] + flow[1, 3, 5], output_low, output_high)
    return on_motor, on_output
