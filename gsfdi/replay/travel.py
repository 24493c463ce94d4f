"""From one event to the next, in equal substeps.

What a step gets wrong where friction turns is small beside the motion and large beside the noise of a long recording:
a motor that sticks while the spring's torque changes crept by 1e-7 rad, which pulled a gearbox of 130,000 N m/rad by a
hundredth of a newton metre and made fits blame its stiffness. So what sticks keeps its angle exactly, and only a
substep in which friction turns round, or a play is crossed, is taken again in parts.
"""

import math

from gsfdi import motion
from gsfdi.replay import layout as at
from gsfdi.replay.compiling import compiled, inlined
from gsfdi.replay.flow import advance, transitions
from gsfdi.replay.friction import STICKS, TURNS, dry_range, stop_dry
from gsfdi.replay.laws import any_in, mapped, product, see, total

PHASE_STEP = 1.4  # [rad] of a term's wave per substep; the laws give its mean over the step and how early it acts
MOST_SUBSTEPS = 400
PARTS = 4
"""Parts at least into which a substep is cut in which friction turns round or a play is entered or left."""
MOST_PARTS = 64
TURN_DECAY = 0.5
"""Decay of speed in each part by a friction that turns round smoothly.

In four parts of 2 ms a rigid joint of 3 kg m² with 3 N m that turn round by 5e-4 rad/s, a decay of 4, had efforts that
were wrong by twice their noise.
"""
LOOSE = 4
"""How much further the flows stand of a gearbox within its play."""


@inlined
def travel(model, era, powers, m, v, states, flow, clock, state, now):  # type: ignore[no-untyped-def]
    """Advance the state from event `now` to the next."""
    span = clock[now + 1, at.TIME] - clock[now, at.TIME]
    if span <= 0.0:
        return
    turns = model[at.SLOW] > 0 or (
        model[at.RIGID] == 0 and (any_in(at.MOTOR_DRY, model) or any_in(at.OUTPUT_DRY, model) or model[at.PLAY] > 0)
    )
    delayed = any_in(at.DELAY, model)  # the delayed effort changes within the span
    if model[at.WAVE] > 0 or abs(span - v[at.FITTED, 1]) > 1e-8 * span:  # stamps in float64 differ by less
        longest = model[at.LONGEST_STEP]
        if model[at.WAVE] > 0:
            longest = min(longest, PHASE_STEP / max(1e-12, abs(model[at.WAVE] * model[at.GEAR] * v[at.X, 1])))
        least = 2.0 if delayed and model[at.RIGID] == 0 else 1.0  # a change within a step excites a mode
        count = min(max(least, math.ceil(span / longest - 1e-9)), float(MOST_SUBSTEPS))
        h = span / count
        if abs(h - v[at.FITTED, 0]) > 1e-8 * h:
            spread(model, powers, 0.5 * h, flow, 0)
            v[at.FITTED, 0], v[at.FITTED, 3] = h, 0.0
        v[at.FITTED, 1], v[at.FITTED, 2] = span, count
    count, h = int(v[at.FITTED, 2]), v[at.FITTED, 0]
    effort, early = state[now, at.FLOWING], 0.0
    for i in range(count):
        time = clock[now, at.TIME] + i * h
        parts, done = 1, 0
        if turns:
            keep(v, states)
        while done < parts:
            short = h / parts
            begun, first = time + done * short, 0 if parts == 1 else 2
            if delayed:
                m[motion.TIME] = begun
                age = total(at.DELAY, model, m, states)
                effort, early = mean_held(clock, state, now, begun - age, begun + short - age)
            turned = substep(model, era, m, v, states, flow, first, effort, early, begun, short)
            done += 1
            if turned and turns and parts == 1:
                undo(v, states)
                parts, done = parts_of(model, h), 0
                if v[at.FITTED, 3] == 0.0:
                    spread(model, powers, 0.5 * h / parts, flow, 2)
                    v[at.FITTED, 3] = 1.0


@inlined
def parts_of(model, h):  # type: ignore[no-untyped-def]
    """Parts into which a substep of `h` is cut."""
    return min(max(PARTS, math.ceil(h * model[at.TURN_RATE] / TURN_DECAY)), MOST_PARTS)


@compiled
def spread(model, powers, half, flow, first):  # type: ignore[no-untyped-def]
    """Fill the flows of a substep from `first` on, and `LOOSE` further those without the spring if there is a play."""
    transitions(model, powers[0], half, flow, first)
    if model[at.PLAY] > 0:
        transitions(model, powers[1], half, flow, LOOSE + first)


@compiled
def keep(v, states):  # type: ignore[no-untyped-def]
    """Keep motion, torques and memories, so that a substep can be undone."""
    for i in range(4):
        v[at.KEPT, i], v[at.KEPT + 1, i] = v[at.X, i], v[at.TORQUES, i]
    remember(states, 0, states.size // 2)


@compiled
def undo(v, states):  # type: ignore[no-untyped-def]
    """Go back to what was kept."""
    for i in range(4):
        v[at.X, i], v[at.TORQUES, i] = v[at.KEPT, i], v[at.KEPT + 1, i]
    remember(states, states.size // 2, 0)


@compiled
def remember(states, source, target):  # type: ignore[no-untyped-def]
    """Copy the memories of all terms within `states`; what a law with few of them leaves NaN is not worth the time."""
    for first in range(0, states.size // 2 - 1, motion.STATES):
        more = not math.isnan(states[source + first + motion.FEW])
        for i in range(first, first + (motion.STATES if more else motion.FEW + 1)):
            states[target + i] = states[source + i]


@inlined
def substep(model, era, m, v, states, flow, first, effort, early, time, h):  # type: ignore[no-untyped-def]
    """Advance the state by one substep; half its flow and all of it stand in `flow` from `first` on.

    Returns
    -------
    bool
        Whether a dry friction began or ceased to slide, or turned round, at once or smoothly, or a play was entered
        or left.
    """
    loose = is_loose(model, m, v, states, time)
    first, rate = (first + LOOSE, 0.0) if loose else (first, model[era + at.SPRING_RATE])
    full, beyond = first + 1, model[era + at.SPRING_RATE] - rate
    drive = model[era + at.DRIVE_GAIN] * effort
    spring = v[at.TORQUES, 3] + beyond * v[at.X, 2]
    on_motor = v[at.TORQUES, 0] * drive + spring - v[at.TORQUES, 1]
    advance(flow, first, v, at.X, at.MIDDLE, on_motor, -spring - v[at.TORQUES, 2])
    slow = is_slow(model, v)
    see(model, m, v, at.MIDDLE, time + 0.5 * h)
    m[motion.STEP], m[motion.CURRENT], m[motion.STIFFNESS] = h, effort, model[era + at.SPRING_RATE]
    m[motion.EARLY] = 0.0
    factor = product(at.TORQUE_CONSTANT, model, m, states)
    drive_early, m[motion.EARLY] = drive * m[motion.EARLY], 0.0
    spring, lever = 0.0, 0.0
    if any_in(at.WINDUP, model) or any_in(at.SPRING, model):
        spring, lever = spring_terms(model, era, rate, m, states, v[at.MIDDLE, 2])
    m[motion.LOAD] = factor * drive if model[at.RIGID] > 0 else rate * v[at.MIDDLE, 2] + spring
    on_output = total(at.OUTPUT_TORQUE, model, m, states)
    motor_low, motor_high, output_low, output_high = 0.0, 0.0, 0.0, 0.0
    if any_in(at.OUTPUT_DRY, model):
        output_low, output_high = dry_range(at.OUTPUT_DRY, model, m, states)
    m[motion.ANGLE], m[motion.SPEED] = v[at.MIDDLE, 0], v[at.MIDDLE, 1]
    m[motion.ANGLE_JUMPED] = v[at.JUMPED, 0]
    spring_early, m[motion.EARLY] = -rate * m[motion.EARLY], 0.0
    on_motor = total(at.MOTOR_TORQUE, model, m, states) - lever
    if any_in(at.MOTOR_DRY, model):
        motor_low, motor_high = dry_range(at.MOTOR_DRY, model, m, states)
    advance(flow, full, v, at.X, at.FREE, factor * drive + spring - on_motor, -spring - on_output)
    if model[at.WAVE] > 0:
        lead(flow, first, v, drive_early + spring_early - m[motion.EARLY], -spring_early)
    dry_motor, dry_output, motor_early, output_early, motor_did, output_did, motor_slid, output_slid = stop_dry(
        flow, full, v, motor_low, motor_high, output_low, output_high
    )
    motor, joint = v[at.X, 0], v[at.X, 0] + v[at.X, 2]
    for i in range(4):
        v[at.X, i] = v[at.FREE, i] - flow[full, 4, i] * dry_motor - flow[full, 5, i] * dry_output
    motor_early -= factor * model[era + at.DRIVE_GAIN] * early
    for i in (0, 2):
        v[at.X, i] -= h * (flow[full, 4, i + 1] * motor_early + flow[full, 5, i + 1] * output_early)
    if motor_did == STICKS:
        motor += h * motor_slid
        v[at.X, 2] += v[at.X, 0] - motor if model[at.RIGID] == 0 else 0.0
        v[at.X, 0] = motor
    if output_did == STICKS:
        v[at.X, 2] = joint + h * output_slid - v[at.X, 0]
    v[at.TORQUES, 0], v[at.TORQUES, 3] = factor, spring - beyond * v[at.MIDDLE, 2]
    v[at.TORQUES, 1], v[at.TORQUES, 2] = on_motor + dry_motor, on_output + dry_output
    return motor_did == TURNS or output_did == TURNS or slow or loose != is_loose(model, m, v, states, time + h)


@compiled
def lead(flow, first, v, on_motor, on_output):  # type: ignore[no-untyped-def]
    """Move the free motion by what torques do that act `on_motor` and `on_output` before their mean over the step.

    Of a torque whose product with half the step less the time gone by has the mean h E that is h² A Φ(h/2) B E, to the
    third order of the step; Γ(h) less twice Γ(h/2) is a quarter of h² A Φ(h/2) B.
    """
    for i in range(4):
        v[at.FREE, i] += 4.0 * on_motor * (flow[first + 1, 4, i] - 2.0 * flow[first, 4, i])
        v[at.FREE, i] += 4.0 * on_output * (flow[first + 1, 5, i] - 2.0 * flow[first, 5, i])


@inlined
def is_slow(model, v):  # type: ignore[no-untyped-def]
    """Whether a friction turns round smoothly between the state and the middle of the step."""
    return (
        passes(v[at.X, 1], v[at.MIDDLE, 1], model[at.SLOW])
        or passes(v[at.X, 1] + v[at.X, 3], v[at.MIDDLE, 1] + v[at.MIDDLE, 3], model[at.SLOW])
    )  # fmt: skip


@inlined
def passes(before, after, reach):  # type: ignore[no-untyped-def]
    """Whether a speed comes within reach of zero."""
    return reach > 0.0 and (min(abs(before), abs(after)) < reach or before * after < 0.0)


@compiled
def is_loose(model, m, v, states, time):  # type: ignore[no-untyped-def]
    """Whether the gearbox is within its play, where the spring's deflection is exactly zero."""
    if model[at.PLAY] == 0:
        return False
    see(model, m, v, at.X, time)
    return mapped(at.WINDUP, model, m, states, v[at.X, 2]) == 0.0


@inlined
def spring_terms(model, era, rate, m, states, windup):  # type: ignore[no-untyped-def]
    """Spring torque beyond `rate` times the wind-up on the output, and what the lever adds to it all on the motor."""
    m[motion.LEVER] = 1.0
    deflection = mapped(at.WINDUP, model, m, states, windup)
    m[motion.WINDUP] = deflection
    spring = model[era + at.SPRING_RATE] * deflection - rate * windup + total(at.SPRING, model, m, states)
    return spring, (m[motion.LEVER] - 1.0) * (rate * windup + spring)


@compiled
def mean_held(clock, state, now, low, high):  # type: ignore[no-untyped-def]
    """Mean over [low, high] of the effort commanded up to event `now`, and how far it acts before its mean.

    Each value is held until the next. For what acts before its mean see `dry_over`.
    """
    j = now
    while j > 0 and clock[j, at.TIME] > low:
        j -= 1
    whole, early, start = 0.0, 0.0, low
    while start < high:
        end = high if j >= now else min(high, max(clock[j + 1, at.TIME], start))
        part = state[j, at.FLOWING] * (end - start)
        whole += part
        early += 0.5 * part * ((high - end) - (start - low))
        start = end
        j += 1
    return whole / (high - low), early / (high - low) ** 2
