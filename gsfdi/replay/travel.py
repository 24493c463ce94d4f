"""From one event to the next, in equal substeps."""

import math

from gsfdi import motion
from gsfdi.replay import layout as at
from gsfdi.replay.compiling import compiled, inlined
from gsfdi.replay.flow import advance, transition
from gsfdi.replay.friction import dry_range, stop_dry
from gsfdi.replay.laws import any_in, mapped, product, see, total

PHASE_STEP = 0.7  # [rad] of a term's wave per substep; the laws give its mean over the step
MOST_SUBSTEPS = 400


@inlined
def travel(model, era, powers, m, v, states, flow, clock, state, now):  # type: ignore[no-untyped-def]
    """Advance the state from event `now` to the next."""
    span = clock[now + 1, at.TIME] - clock[now, at.TIME]
    if span <= 0.0:
        return
    delayed = any_in(at.DELAY, model)  # the delayed effort changes within the span: its mean over a part of it acts
    if model[at.WAVE] > 0 or abs(span - v[at.FITTED, 1]) > 1e-8 * span:  # stamps in float64 differ by less
        longest = model[at.LONGEST_STEP]
        if model[at.WAVE] > 0:
            longest = min(longest, PHASE_STEP / max(1e-12, abs(model[at.WAVE] * model[at.GEAR] * v[at.X, 1])))
        count = min(max(4.0 if delayed else 1.0, math.ceil(span / longest - 1e-9)), float(MOST_SUBSTEPS))
        h = span / count
        if abs(h - v[at.FITTED, 0]) > 1e-8 * h:
            transition(model, era, powers, 0.5 * h, flow, 0)
            transition(model, era, powers, h, flow, 1)
            v[at.FITTED, 0] = h
        v[at.FITTED, 1], v[at.FITTED, 2] = span, count
    count, h = int(v[at.FITTED, 2]), v[at.FITTED, 0]
    effort = state[now, at.FLOWING]
    for i in range(count):
        time = clock[now, at.TIME] + i * h
        if delayed:
            m[motion.TIME] = time
            age = total(at.DELAY, model, m, states)
            effort = mean_held(clock, state, now, time - age, time + h - age)
        substep(model, era, m, v, states, flow, effort, time, h)


@inlined
def substep(model, era, m, v, states, flow, effort, time, h):  # type: ignore[no-untyped-def]
    """Advance the state by one substep."""
    drive = model[era + at.DRIVE_GAIN] * effort
    on_motor = v[at.TORQUES, 0] * drive + v[at.TORQUES, 3] - v[at.TORQUES, 1]
    advance(flow, 0, v, at.X, at.MIDDLE, on_motor, -v[at.TORQUES, 3] - v[at.TORQUES, 2])
    see(model, m, v, at.MIDDLE, time + 0.5 * h)
    m[motion.STEP], m[motion.CURRENT], m[motion.STIFFNESS] = h, effort, model[era + at.SPRING_RATE]
    factor = product(at.TORQUE_CONSTANT, model, m, states)
    spring, lever = 0.0, 0.0
    if any_in(at.WINDUP, model) or any_in(at.SPRING, model):
        spring, lever = spring_terms(model, era, m, states, v[at.MIDDLE, 2])
    m[motion.LOAD] = factor * drive if model[at.RIGID] > 0 else model[era + at.SPRING_RATE] * v[at.MIDDLE, 2] + spring
    on_output = total(at.OUTPUT_TORQUE, model, m, states)
    motor_low, motor_high, output_low, output_high = 0.0, 0.0, 0.0, 0.0
    if any_in(at.OUTPUT_DRY, model):
        output_low, output_high = dry_range(at.OUTPUT_DRY, model, m, states)
    m[motion.ANGLE], m[motion.SPEED] = v[at.MIDDLE, 0], v[at.MIDDLE, 1]
    on_motor = total(at.MOTOR_TORQUE, model, m, states) - lever
    if any_in(at.MOTOR_DRY, model):
        motor_low, motor_high = dry_range(at.MOTOR_DRY, model, m, states)
    advance(flow, 1, v, at.X, at.FREE, factor * drive + spring - on_motor, -spring - on_output)
    dry_motor, dry_output, motor_early, output_early = stop_dry(
        flow, v, motor_low, motor_high, output_low, output_high
    )
    for i in range(4):
        v[at.X, i] = v[at.FREE, i] - flow[1, i, 4] * dry_motor - flow[1, i, 5] * dry_output
    for i in (0, 2):
        v[at.X, i] -= h * (flow[1, i + 1, 4] * motor_early + flow[1, i + 1, 5] * output_early)
    v[at.TORQUES, 0], v[at.TORQUES, 3] = factor, spring
    v[at.TORQUES, 1], v[at.TORQUES, 2] = on_motor + dry_motor, on_output + dry_output


@inlined
def spring_terms(model, era, m, states, windup):  # type: ignore[no-untyped-def]
    """Spring torque beyond c ε on the output, and what the lever adds to it on the motor."""
    m[motion.LEVER] = 1.0
    deflection = mapped(at.WINDUP, model, m, states, windup)
    m[motion.WINDUP] = deflection
    spring = model[era + at.SPRING_RATE] * (deflection - windup) + total(at.SPRING, model, m, states)
    return spring, (m[motion.LEVER] - 1.0) * (model[era + at.SPRING_RATE] * windup + spring)


@compiled
def mean_held(clock, state, now, low, high):  # type: ignore[no-untyped-def]
    """Mean over [low, high] of the effort commanded up to event `now`, each value held until the next."""
    j = now
    while j > 0 and clock[j, at.TIME] > low:
        j -= 1
    result, start = 0.0, low
    while start < high:
        end = high if j >= now else min(high, max(clock[j + 1, at.TIME], start))
        result += state[j, at.FLOWING] * (end - start)
        start = end
        j += 1
    return result / (high - low)
