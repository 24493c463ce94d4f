"""The compiled replay: one kernel runs any combination of terms without compiling for the combination.

Every term's law is compiled once to machine code of one signature and handed to the kernel by its address, so that the
kernel itself is compiled once after installation and loaded from numba's cache ever after.

Between two events (a controller tick, a recorded sample) the joint moves in equal substeps. Within one

1. the linear joint under constant torques is advanced exactly: ``x⁺ = Φ(h) x + Γ(h) w`` with Φ and Γ summed as Taylor
   series of the matrix exponential, whose argument the choice of h keeps below one half;
2. every law is evaluated at the state of the half step, itself advanced by Φ(h/2) under the last substep's torques:
   second order with a single evaluation per substep;
3. dry friction slides at its level up to the instant at which the speed is zero, and is from there on the torque in
   [-level(-), +level(+)] that leaves the least speed at the end of the step (an implicit, set-valued law: it sticks
   exactly, with no velocity threshold); motor and output side are solved together.

State: ``x = [Ω, Ω̇, ε, ε̇]``; a rigid joint keeps ε = 0. Torque inputs ``w`` are the net torque on the motor, reflected
to the output, and on the output.

The kernel takes few and plain arrays, whose layout is fixed by the index constants below, and allocates none. It is
one file because numba's cache notices a change only in the file of the function it has cached.
"""

import math

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from gsfdi import motion
from gsfdi.types import Array

CLOSED_LOOP, OPEN_LOOP, PREDICT, PREDICT_CONTROLLER = range(4)

# Slots in which laws act.
TORQUE_CONSTANT, CURRENT, DELAY, MOTOR_TORQUE, OUTPUT_TORQUE, MOTOR_DRY, OUTPUT_DRY = range(7)
WINDUP, SPRING, POSITION_SENSOR, VELOCITY_SENSOR, CURRENT_SENSOR, LATENCY, SLOTS = range(7, 14)

# A packed model: controller, step, where each slot's terms begin; then a row per era and a row per term.
KP, KI, KD, RATE_FEEDFORWARD, LIMIT, SPEED_AGE, LONGEST_STEP, WAVE, GEAR, RIGID, ERAS, FIRST = range(12)
ERA_ROWS = FIRST + SLOTS + 1
INERTIA_MOTOR, INERTIA_OUTPUT, SPRING_RATE, DAMPING, DRIVE_GAIN, FROM_TIME, ERA_WIDTH = range(7)
ADDRESS, ONSET, PARAMS, TERM_WIDTH = 0, 1, 2, 6

# A row of the clock: what an event brings. RECORD is the number of the sample, -1 where the event is a tick only;
# RESTART the row of the state to restart from, else -1.
TIME, TICK, RECORD, RESTART, SETPOINT, RATE, FEEDFORWARD, EFFORT, POSITION, VELOCITY, TEMPERATURE, EVENT_WIDTH = range(
    12
)

# A row of the states, by event: motion, the integral part of the controller, the effort that flows.
INTEGRAL, FLOWING, STATE_WIDTH = 4, 5, 6

# A row of what a sample shows: position, speed, effort, and in the predict modes the innovations.
SHOWN_EFFORT, INNOVATION, SHOWN_WIDTH = 2, 3, 5

# Rows of the scratch vectors. TORQUES carries factor, motor, output and spring torque from a substep to the next.
X, MIDDLE, FREE, TORQUES, SEEN, SENSED, LATE, MEMORY, FITTED, VECTORS = range(10)

_TAYLOR = 14
_PHASE_STEP = 0.7  # [rad] of a term's wave per substep; the laws give its mean over the step
_MOST_SUBSTEPS = 400


# Nothing is allocated in the kernel, so numba need count no references: that counting, with its atomic instructions,
# took three quarters of the time. Functions with many arguments that are called from one place are inlined.
compiled = njit(cache=True, nogil=True, _nrt=False)
inlined = njit(cache=True, nogil=True, inline="always", _nrt=False)


@intrinsic
def call_law(_typing, address, m, model, row, states, state):  # type: ignore[no-untyped-def]
    """Call the compiled law at `address` on the motion `m`, parameters from `row` of `model`, states from `state`."""

    def codegen(context, builder, signature, args):  # type: ignore[no-untyped-def]
        pointer = ir.DoubleType().as_pointer()
        law = ir.FunctionType(ir.DoubleType(), [pointer] * 3)
        data = [context.make_array(signature.args[i])(context, builder, args[i]).data for i in (1, 2, 4)]
        at = [data[0], builder.gep(data[1], [args[3]]), builder.gep(data[2], [args[5]])]
        return builder.call(builder.inttoptr(args[0], law.as_pointer()), at)

    return types.float64(types.int64, m, model, types.intp, states, types.intp), codegen


@compiled
def any_in(slot, model):  # type: ignore[no-untyped-def]
    """Whether any term acts in `slot`."""
    return model[FIRST + slot] < model[FIRST + slot + 1]


@compiled
def law_of(term, model, m, states):  # type: ignore[no-untyped-def]
    """Evaluate one term's law; the caller has seen to it that it has set in."""
    row = int(model[ERAS]) * ERA_WIDTH + ERA_ROWS + term * TERM_WIDTH
    m[motion.ONSET] = model[row + ONSET]
    return call_law(int(model[row + ADDRESS]), m, model, row + PARAMS, states, 2 * term)


@compiled
def has_set_in(term, model, m):  # type: ignore[no-untyped-def]
    """Whether the onset of a term lies behind."""
    row = int(model[ERAS]) * ERA_WIDTH + ERA_ROWS + term * TERM_WIDTH
    return m[motion.TIME] >= model[row + ONSET]


@compiled
def total(slot, model, m, states):  # type: ignore[no-untyped-def]
    """Sum of the laws in `slot` that have set in."""
    result = 0.0
    if any_in(slot, model):
        for term in range(int(model[FIRST + slot]), int(model[FIRST + slot + 1])):
            if has_set_in(term, model, m):
                result += law_of(term, model, m, states)
    return result


@compiled
def product(slot, model, m, states):  # type: ignore[no-untyped-def]
    """Product of the factors in `slot`."""
    result = 1.0
    if any_in(slot, model):
        for term in range(int(model[FIRST + slot]), int(model[FIRST + slot + 1])):
            if has_set_in(term, model, m):
                result *= law_of(term, model, m, states)
    return result


@compiled
def mapped(slot, model, m, states, value):  # type: ignore[no-untyped-def]
    """`value` after the maps in `slot`, one upon the other."""
    if any_in(slot, model):
        m[motion.VALUE] = value
        for term in range(int(model[FIRST + slot]), int(model[FIRST + slot + 1])):
            if has_set_in(term, model, m):
                m[motion.VALUE] = law_of(term, model, m, states)
        value = m[motion.VALUE]
    return value


@compiled
def unmapped(slot, model, m, states, value):  # type: ignore[no-untyped-def]
    """What an affine chain of maps turned into `value`."""
    if not any_in(slot, model):
        return value
    low = mapped(slot, model, m, states, 0.0)
    return (value - low) / (mapped(slot, model, m, states, 1.0) - low)


@compiled
def series(model, era, powers):  # type: ignore[no-untyped-def]
    """Fill ``powers[k] = A^k / k!`` for the plant of the era that begins at index `era` of the model."""
    matrix = powers[_TAYLOR + 1]  # spare room
    for i in range(4):
        for j in range(4):
            matrix[i, j] = 0.0
    drag = model[era + DAMPING] / model[era + INERTIA_OUTPUT]
    matrix[0, 1] = 1.0
    if model[RIGID] > 0:
        matrix[1, 1] = -drag
    else:
        on_motor = model[era + SPRING_RATE] / model[era + INERTIA_MOTOR]
        matrix[1, 2], matrix[2, 3] = on_motor, 1.0
        matrix[3, 1], matrix[3, 3] = -drag, -drag
        matrix[3, 2] = -on_motor - model[era + SPRING_RATE] / model[era + INERTIA_OUTPUT]
    for k in range(_TAYLOR + 1):
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
            phi, held = powers[_TAYLOR, i, j], powers[_TAYLOR, i, j] / (_TAYLOR + 1)
            for k in range(_TAYLOR - 1, -1, -1):
                phi = phi * h + powers[k, i, j]
                held = held * h + powers[k, i, j] / (k + 1)
            flow[which, i, j] = phi
            if j == 1:
                held_motor = held * h
            elif j == 3:
                held_output = held * h
        if model[RIGID] > 0:
            flow[which, i, 4] = held_motor / model[era + INERTIA_OUTPUT]
            flow[which, i, 5] = flow[which, i, 4]
        else:
            flow[which, i, 4] = (held_motor - held_output) / model[era + INERTIA_MOTOR]
            flow[which, i, 5] = held_output / model[era + INERTIA_OUTPUT]


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
def see(model, m, v, row, time):  # type: ignore[no-untyped-def]
    """Write the motion of a row of the vectors into `m`, seen from the output side."""
    m[motion.TIME] = time
    m[motion.ANGLE] = m[motion.JOINT_ANGLE] = v[row, 0] + v[row, 2]
    m[motion.SPEED] = v[row, 1] + v[row, 3]
    m[motion.GEAR], m[motion.MOTOR_TURN] = model[GEAR], model[GEAR] * v[row, 0]
    m[motion.WINDUP], m[motion.WINDUP_RATE] = v[row, 2], v[row, 3]
    m[motion.DIRECTION] = 1.0 if m[motion.SPEED] >= 0 else -1.0


@inlined
def spring_terms(model, era, m, states, windup):  # type: ignore[no-untyped-def]
    """Spring torque beyond c ε on the output, and what the lever adds to it on the motor."""
    m[motion.LEVER] = 1.0
    deflection = mapped(WINDUP, model, m, states, windup)
    m[motion.WINDUP] = deflection
    spring = model[era + SPRING_RATE] * (deflection - windup) + total(SPRING, model, m, states)
    return spring, (m[motion.LEVER] - 1.0) * (model[era + SPRING_RATE] * windup + spring)


@inlined
def stop_dry(flow, v, motor_low, motor_high, output_low, output_high):  # type: ignore[no-untyped-def]
    """Dry friction on motor and output that brings the speeds of the free motion nearest to zero."""
    on_motor, on_output = 0.0, 0.0
    if motor_low == 0.0 and motor_high == 0.0 and output_low == 0.0 and output_high == 0.0:
        return on_motor, on_output
    for _ in range(3):
        speed = v[FREE, 1] - flow[1, 1, 5] * on_output
        on_motor = dry_mean(v[X, 1], speed, flow[1, 1, 4], motor_low, motor_high)
        if output_low == 0.0 and output_high == 0.0:
            break
        speed = v[FREE, 1] + v[FREE, 3] - (flow[1, 1, 4] + flow[1, 3, 4]) * on_motor
        on_output = dry_mean(v[X, 1] + v[X, 3], speed, flow[1, 1, 5] + flow[1, 3, 5], output_low, output_high)
    return on_motor, on_output


@inlined
def substep(model, era, m, v, states, flow, effort, time, h):  # type: ignore[no-untyped-def]
    """Advance the state by one substep."""
    drive = model[era + DRIVE_GAIN] * effort
    on_motor = v[TORQUES, 0] * drive + v[TORQUES, 3] - v[TORQUES, 1]
    advance(flow, 0, v, X, MIDDLE, on_motor, -v[TORQUES, 3] - v[TORQUES, 2])
    see(model, m, v, MIDDLE, time + 0.5 * h)
    m[motion.STEP], m[motion.CURRENT], m[motion.STIFFNESS] = h, effort, model[era + SPRING_RATE]
    factor = product(TORQUE_CONSTANT, model, m, states)
    spring, lever = 0.0, 0.0
    if any_in(WINDUP, model) or any_in(SPRING, model):
        spring, lever = spring_terms(model, era, m, states, v[MIDDLE, 2])
    m[motion.LOAD] = factor * drive if model[RIGID] > 0 else model[era + SPRING_RATE] * v[MIDDLE, 2] + spring
    on_output = total(OUTPUT_TORQUE, model, m, states)
    motor_low, motor_high, output_low, output_high = 0.0, 0.0, 0.0, 0.0
    if any_in(OUTPUT_DRY, model):
        output_low, output_high = dry_range(OUTPUT_DRY, model, m, states)
    m[motion.ANGLE], m[motion.SPEED] = v[MIDDLE, 0], v[MIDDLE, 1]
    on_motor = total(MOTOR_TORQUE, model, m, states) - lever
    if any_in(MOTOR_DRY, model):
        motor_low, motor_high = dry_range(MOTOR_DRY, model, m, states)
    advance(flow, 1, v, X, FREE, factor * drive + spring - on_motor, -spring - on_output)
    dry_motor, dry_output = stop_dry(flow, v, motor_low, motor_high, output_low, output_high)
    for i in range(4):
        v[X, i] = v[FREE, i] - flow[1, i, 4] * dry_motor - flow[1, i, 5] * dry_output
    v[TORQUES, 0], v[TORQUES, 3] = factor, spring
    v[TORQUES, 1], v[TORQUES, 2] = on_motor + dry_motor, on_output + dry_output


@compiled
def mean_held(clock, state, now, low, high):  # type: ignore[no-untyped-def]
    """Mean over [low, high] of the effort commanded up to event `now`, each value held until the next."""
    j = now
    while j > 0 and clock[j, TIME] > low:
        j -= 1
    result, start = 0.0, low
    while start < high:
        end = high if j >= now else min(high, max(clock[j + 1, TIME], start))
        result += state[j, FLOWING] * (end - start)
        start = end
        j += 1
    return result / (high - low)


@inlined
def travel(model, era, powers, m, v, states, flow, clock, state, now):  # type: ignore[no-untyped-def]
    """Advance the state from event `now` to the next."""
    span = clock[now + 1, TIME] - clock[now, TIME]
    if span <= 0.0:
        return
    delayed = any_in(DELAY, model)  # the delayed effort changes within the span: its mean over a part of it acts
    if model[WAVE] > 0 or abs(span - v[FITTED, 1]) > 1e-8 * span:  # stamps in float64 differ by less
        longest = model[LONGEST_STEP]
        if model[WAVE] > 0:
            longest = min(longest, _PHASE_STEP / max(1e-12, abs(model[WAVE] * model[GEAR] * v[X, 1])))
        count = min(max(4.0 if delayed else 1.0, math.ceil(span / longest - 1e-9)), float(_MOST_SUBSTEPS))
        h = span / count
        if abs(h - v[FITTED, 0]) > 1e-8 * h:
            transition(model, era, powers, 0.5 * h, flow, 0)
            transition(model, era, powers, h, flow, 1)
            v[FITTED, 0] = h
        v[FITTED, 1], v[FITTED, 2] = span, count
    count, h = int(v[FITTED, 2]), v[FITTED, 0]
    effort = state[now, FLOWING]
    for i in range(count):
        time = clock[now, TIME] + i * h
        if delayed:
            m[motion.TIME] = time
            age = total(DELAY, model, m, states)
            effort = mean_held(clock, state, now, time - age, time + h - age)
        substep(model, era, m, v, states, flow, effort, time, h)


@inlined
def sense(model, m, v, states, row, target, time, noise, resolution, now):  # type: ignore[no-untyped-def]
    """Write into row `target` what sensors give of row `row`: joint angle; motor speed (joint speed if rigid)."""
    see(model, m, v, row, time)
    v[target, 0] = mapped(POSITION_SENSOR, model, m, states, v[row, 0] + v[row, 2])
    speed = v[row, 1] if model[RIGID] > 0 else model[GEAR] * v[row, 1]
    v[target, 1] = mapped(VELOCITY_SENSOR, model, m, states, speed)
    for i in range(2):
        if noise.shape[0] > 0:
            v[target, i] += noise[now, i]
        if resolution[i] > 0:
            v[target, i] = round(v[target, i] / resolution[i]) * resolution[i]


@compiled
def motion_at(clock, state, now, time, v):  # type: ignore[no-untyped-def]
    """Write the motion at `time`, at or before event `now`, into row SEEN: cubic between events."""
    j = now
    while j > 0 and clock[j, TIME] > time:
        j -= 1
    last = min(j + 1, now)
    span = clock[last, TIME] - clock[j, TIME]
    u = 0.0 if span <= 0.0 or time <= clock[0, TIME] else (time - clock[j, TIME]) / span
    for i in (0, 2):
        a, b = state[j, i], state[last, i]
        da, db = span * state[j, i + 1], span * state[last, i + 1]
        v[SEEN, i] = a + u * (da + u * (3 * (b - a) - 2 * da - db + u * (2 * (a - b) + da + db)))
        v[SEEN, i + 1] = (1 - u) * state[j, i + 1] + u * state[last, i + 1]


@inlined
def control(model, clock, now, position, speed, v):  # type: ignore[no-untyped-def]
    """Effort of the controller; `speed` is reflected to the output.

    MEMORY keeps the integral part (trapezoidal), the error and the time of the last tick; NaN where there was none.
    """
    error = clock[now, SETPOINT] - position
    integral = v[MEMORY, 0]
    if v[MEMORY, 2] < clock[now, TIME]:  # false of NaN: the integral part is then given for this very tick
        integral += 0.5 * model[KI] * (error + v[MEMORY, 1]) * (clock[now, TIME] - v[MEMORY, 2])
    effort = model[KP] * error + integral + clock[now, FEEDFORWARD]
    effort += model[KD] * (model[RATE_FEEDFORWARD] * clock[now, RATE] - speed)
    limited = min(max(effort, -model[LIMIT]), model[LIMIT])
    # Anti-windup: no further integration into a limit that already holds.
    if effort == limited or (effort - limited) * error < 0:
        v[MEMORY, 0] = integral
    v[MEMORY, 1], v[MEMORY, 2] = error, clock[now, TIME]
    return limited


@compiled
def begin(start, row, v, states):  # type: ignore[no-untyped-def]
    """Set the state: motion, integral part of the controller (NaN keeps it), fresh memories of terms."""
    for i in range(4):
        v[X, i] = start[row, i]
        v[TORQUES, i] = 0.0
    v[TORQUES, 0] = 1.0
    if math.isfinite(start[row, INTEGRAL]):
        v[MEMORY, 0], v[MEMORY, 1], v[MEMORY, 2] = start[row, INTEGRAL], 0.0, np.nan
    for i in range(states.size):
        states[i] = np.nan


@inlined
def command(model, mode, m, v, states, clock, state, now, held, noise, resolution):  # type: ignore[no-untyped-def]
    """Effort that flows from event `now` on."""
    ratio = 1.0 if model[RIGID] > 0 else model[GEAR]
    if mode == CLOSED_LOOP:
        if clock[now, TICK] > 0:
            speed = v[SENSED, 1]
            if model[SPEED_AGE] > 0:
                motion_at(clock, state, now, clock[now, TIME] - model[SPEED_AGE], v)
                sense(model, m, v, states, SEEN, LATE, clock[now, TIME], noise, resolution, now)
                see(model, m, v, X, clock[now, TIME])
                speed = v[LATE, 1]
            held = control(model, clock, now, v[SENSED, 0], speed / ratio, v)
            held = mapped(CURRENT, model, m, states, held)
    elif mode == PREDICT_CONTROLLER:
        if clock[now, TICK] > 0 and math.isfinite(clock[now, POSITION] + clock[now, VELOCITY]):
            held = control(model, clock, now, clock[now, POSITION], clock[now, VELOCITY] / ratio, v)
            held = mapped(CURRENT, model, m, states, held)
    elif math.isfinite(clock[now, EFFORT]):
        held = unmapped(CURRENT_SENSOR, model, m, states, clock[now, EFFORT])
        held = mapped(CURRENT, model, m, states, held)
    return held


@inlined
def show(model, mode, m, v, states, clock, now, noise, resolution, gain, state, shown):  # type: ignore[no-untyped-def]
    """Write what the log holds of a sample, which late stamps make older; an observer corrects its state by it."""
    sample, source = int(clock[now, RECORD]), SENSED
    if any_in(LATENCY, model):
        motion_at(clock, state, now, clock[now, TIME] - total(LATENCY, model, m, states), v)
        sense(model, m, v, states, SEEN, LATE, clock[now, TIME], noise, resolution, now)
        see(model, m, v, X, clock[now, TIME])
        source = LATE
    for i in range(2):
        shown[sample, i] = v[source, i]
        shown[sample, INNOVATION + i] = np.nan
        if mode >= PREDICT:
            shown[sample, INNOVATION + i] = clock[now, POSITION + i] - v[source, i]
            if math.isfinite(clock[now, POSITION + i]):
                for n in range(4):
                    v[X, n] += gain[n, i] * shown[sample, INNOVATION + i]


@compiled
def blank(clock, now, state, shown):  # type: ignore[no-untyped-def]
    """Write not-a-number from event `now` on, where the model has run away."""
    for k in range(now, clock.shape[0]):
        for i in range(STATE_WIDTH):
            state[k, i] = np.nan
        for i in range(SHOWN_WIDTH if clock[k, RECORD] >= 0 else 0):
            shown[int(clock[k, RECORD]), i] = np.nan


@inlined
def run(model, clock, noise, resolution, mode, start, gain, restarts, state, shown, m, v, flow, powers, states):  # type: ignore[no-untyped-def]
    """Replay one model.

    `start` (1, 5) and `restarts` (k, 5) hold motion and the integral part; `state` and `shown` are filled; what
    follows them is scratch (see `scratch`).
    """
    v[MEMORY, 0], v[MEMORY, 2] = 0.0, np.nan
    v[FITTED, 0] = v[FITTED, 1] = 0.0
    begin(start, 0, v, states)
    era, last_era = ERA_ROWS, ERA_ROWS + (int(model[ERAS]) - 1) * ERA_WIDTH
    series(model, era, powers)
    held, events = 0.0, clock.shape[0]
    for now in range(events):
        time = clock[now, TIME]
        m[motion.TEMPERATURE] = clock[now, TEMPERATURE]
        if era < last_era and time >= model[era + ERA_WIDTH + FROM_TIME] - 1e-9:
            era += ERA_WIDTH
            series(model, era, powers)
            v[FITTED, 0] = v[FITTED, 1] = 0.0
        if clock[now, RESTART] >= 0:
            begin(restarts, int(clock[now, RESTART]), v, states)
        for i in range(4):
            state[now, i] = v[X, i]
        sense(model, m, v, states, X, SENSED, time, noise, resolution, now)
        if clock[now, RECORD] >= 0:
            show(model, mode, m, v, states, clock, now, noise, resolution, gain, state, shown)
        held = command(model, mode, m, v, states, clock, state, now, held, noise, resolution)
        state[now, INTEGRAL], state[now, FLOWING] = v[MEMORY, 0], held
        if clock[now, RECORD] >= 0:
            shown[int(clock[now, RECORD]), SHOWN_EFFORT] = mapped(CURRENT_SENSOR, model, m, states, held)
        if not abs(v[X, 0]) + abs(v[X, 1]) + abs(v[X, 2]) + abs(v[X, 3]) < 1e9:
            blank(clock, now, state, shown)
            break
        if now + 1 < events:
            travel(model, era, powers, m, v, states, flow, clock, state, now)


@compiled
def run_many(models, clock, noise, resolution, mode, starts, gains, restarts, state, shown, m, v, flow, powers, states):  # type: ignore[no-untyped-def]
    """Replay a batch: one row of every array per model, the scratch shared."""
    for b in range(models.shape[0]):
        run(
            models[b],
            clock,
            noise,
            resolution,
            mode,
            starts[b],
            gains[b],
            restarts[b],
            state[b],
            shown[b],
            m,
            v,
            flow,
            powers,
            states,
        )


def scratch(terms: int) -> tuple[Array, Array, Array, Array, Array]:
    """Room for the motion vector, state vectors, Φ and Γ, the exponential's series, and the states of `terms` terms."""
    return (
        np.zeros(motion.QUANTITIES),
        np.zeros((VECTORS, 4)),
        np.zeros((2, 4, 6)),
        np.zeros((_TAYLOR + 2, 4, 4)),
        np.zeros(motion.STATES * terms + 1),
    )
