"""The compiled replay: one kernel runs any combination of terms without compiling for the combination.

Every term's law is compiled once to machine code of one signature and handed to the kernel by its address, so that the
kernel itself is compiled once after installation and loaded from numba's cache ever after.

Between two events (a controller tick, a recorded sample) the joint moves in equal substeps. Within one

1. the linear joint under constant torques is advanced exactly: ``x⁺ = Φ(h) x + Γ(h) w`` with Φ and Γ summed as Taylor
   series of the matrix exponential, whose argument the choice of h keeps below one half;
2. every law is evaluated at the state of the half step, itself advanced by Φ(h/2) under the last substep's torques:
   second order with a single evaluation per substep;
3. dry friction is the torque in [-level(-), +level(+)] that brings the speed at the end of the step nearest to zero (an
   implicit, set-valued law: it sticks exactly, with no velocity threshold), motor and output side solved together.

State: ``x = [Ω, Ω̇, ε, ε̇]``; a rigid joint keeps ε = 0. Torque inputs ``w`` are the net torque on the motor,
reflected to the output, and on the output.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

from gsfdi import motion
from gsfdi.motion import QUANTITIES
from gsfdi.types import Array

Ints = npt.NDArray[np.int64]

TORQUE_CONSTANT, CURRENT, DELAY, MOTOR_TORQUE, OUTPUT_TORQUE, MOTOR_DRY, OUTPUT_DRY = range(7)
WINDUP, SPRING, POSITION_SENSOR, VELOCITY_SENSOR, CURRENT_SENSOR, LATENCY = range(7, 13)
SLOTS = 13

CLOSED_LOOP, OPEN_LOOP, PREDICT, PREDICT_CONTROLLER = range(4)

INERTIA_MOTOR, INERTIA_OUTPUT, SPRING_RATE, DAMPING, DRIVE_GAIN, RIGID, FROM_TIME = range(7)
"""Columns of a row of `Joint.eras`."""

KP, KI, KD, RATE_FEEDFORWARD, LIMIT = range(5)
"""Entries of `Joint.controller`."""

LONGEST_STEP, WAVE, GEAR = range(3)
"""Entries of `Joint.steps`: greatest substep [s], greatest order of a wave on the motor, gear ratio."""

_ORDER = 14
_PHASE_STEP = 0.35  # [rad] of a term's wave per substep: the mean of a sine over it is 0.5 % off at most


class Joint(NamedTuple):
    """A model packed for the kernel.

    ``eras`` (k, 7) holds the plant, one row for each span of time in which it is constant; ``first`` (SLOTS + 1,) says
    where in the term arrays each slot begins; ``states`` is scratch.
    """

    eras: Array
    controller: Array
    steps: Array
    address: Ints
    first: Ints
    params: Array
    onset: Array
    states: Array


class Clock(NamedTuple):
    """What drives a replay, at every event (E,): controller ticks and recorded samples in order of time.

    ``record`` holds the number of the sample, -1 where the event is a tick only; ``restart`` the row of the state to
    restart from, else -1. ``noise`` (E, 2) is added to what the sensors give the controller, or has no rows.
    """

    time: Array
    tick: npt.NDArray[np.bool_]
    record: Ints
    restart: Ints
    setpoint: Array
    rate: Array
    feedforward: Array
    effort: Array
    position: Array
    velocity: Array
    temperature: Array
    noise: Array
    resolution: Array


class Out(NamedTuple):
    """Room for what a replay gives: ``state`` and ``effort`` by event, ``sensed`` and ``innovation`` by sample."""

    state: Array
    effort: Array
    sensed: Array
    innovation: Array


@intrinsic
def call_law(_typing, address, m, p, s):  # type: ignore[no-untyped-def]
    """Call the compiled law at `address` on three arrays."""

    def codegen(context, builder, signature, args):  # type: ignore[no-untyped-def]
        pointer = ir.DoubleType().as_pointer()
        law = ir.FunctionType(ir.DoubleType(), [pointer] * 3)
        arrays = [
            builder.bitcast(context.make_array(kind)(context, builder, value).data, pointer)
            for kind, value in zip(signature.args[1:], args[1:], strict=True)
        ]
        return builder.call(builder.inttoptr(args[0], law.as_pointer()), arrays)

    return types.float64(types.int64, m, p, s), codegen


@njit(cache=True, nogil=True)
def total(slot, joint, m):  # type: ignore[no-untyped-def]
    """Sum of the laws in `slot` that have set in."""
    result = 0.0
    for j in range(joint.first[slot], joint.first[slot + 1]):
        if m[motion.TIME] >= joint.onset[j]:
            m[motion.ONSET] = joint.onset[j]
            result += call_law(joint.address[j], m, joint.params[j], joint.states[j])
    return result


@njit(cache=True, nogil=True)
def product(slot, joint, m):  # type: ignore[no-untyped-def]
    """Product of the factors in `slot`."""
    result = 1.0
    for j in range(joint.first[slot], joint.first[slot + 1]):
        if m[motion.TIME] >= joint.onset[j]:
            m[motion.ONSET] = joint.onset[j]
            result *= call_law(joint.address[j], m, joint.params[j], joint.states[j])
    return result


@njit(cache=True, nogil=True)
def mapped(slot, joint, m, value):  # type: ignore[no-untyped-def]
    """`value` after the maps in `slot`, one upon the other."""
    m[motion.VALUE] = value
    for j in range(joint.first[slot], joint.first[slot + 1]):
        if m[motion.TIME] >= joint.onset[j]:
            m[motion.ONSET] = joint.onset[j]
            m[motion.VALUE] = call_law(joint.address[j], m, joint.params[j], joint.states[j])
    return m[motion.VALUE]


@njit(cache=True, nogil=True)
def unmapped(slot, joint, m, value):  # type: ignore[no-untyped-def]
    """What an affine chain of maps turned into `value`."""
    if joint.first[slot] == joint.first[slot + 1]:
        return value
    low = mapped(slot, joint, m, 0.0)
    return (value - low) / (mapped(slot, joint, m, 1.0) - low)


@njit(cache=True, nogil=True)
def series(era, a):  # type: ignore[no-untyped-def]
    """Fill ``a[k] = A^k / k!`` for the plant of one era."""
    matrix = np.zeros((4, 4))
    if era[RIGID] > 0:
        matrix[0, 1] = 1.0
        matrix[1, 1] = -era[DAMPING] / era[INERTIA_OUTPUT]
    else:
        motor, output = era[SPRING_RATE] / era[INERTIA_MOTOR], era[SPRING_RATE] / era[INERTIA_OUTPUT]
        drag = era[DAMPING] / era[INERTIA_OUTPUT]
        matrix[0, 1] = matrix[2, 3] = 1.0
        matrix[1, 2] = motor
        matrix[3, 1] = matrix[3, 3] = -drag
        matrix[3, 2] = -motor - output
    a[0] = np.eye(4)
    for k in range(1, _ORDER + 1):
        for i in range(4):
            for j in range(4):
                value = 0.0
                for n in range(4):
                    value += a[k - 1, i, n] * matrix[n, j]
                a[k, i, j] = value / k


@njit(cache=True, nogil=True)
def transition(era, a, h, phi, gamma):  # type: ignore[no-untyped-def]
    """Φ(h) and Γ(h) by Horner's rule over the series `a`."""
    for i in range(4):
        for j in range(4):
            flow, held = a[_ORDER, i, j], a[_ORDER, i, j] / (_ORDER + 1)
            for k in range(_ORDER - 1, -1, -1):
                flow = flow * h + a[k, i, j]
                held = held * h + a[k, i, j] / (k + 1)
            phi[i, j] = flow
            matrix_held = held * h
            if j == 1:
                gamma[i, 0] = matrix_held
            elif j == 3:
                gamma[i, 1] = matrix_held
    for i in range(4):
        on_speed, on_windup = gamma[i, 0], gamma[i, 1]
        if era[RIGID] > 0:
            gamma[i, 0] = gamma[i, 1] = on_speed / era[INERTIA_OUTPUT]
        else:
            gamma[i, 0] = (on_speed - on_windup) / era[INERTIA_MOTOR]
            gamma[i, 1] = on_windup / era[INERTIA_OUTPUT]


@njit(cache=True, nogil=True)
def advance(phi, gamma, x, on_motor, on_output, out):  # type: ignore[no-untyped-def]
    """``out = Φ x + Γ w``."""
    for i in range(4):
        out[i] = (
            phi[i, 0] * x[0]
            + phi[i, 1] * x[1]
            + phi[i, 2] * x[2]
            + phi[i, 3] * x[3]
            + gamma[i, 0] * on_motor
            + gamma[i, 1] * on_output
        )


@njit(cache=True, nogil=True)
def nearest_to_rest(speed, response, low, high):  # type: ignore[no-untyped-def]
    """Torque in [low, high] that leaves the least speed when each unit of it takes away `response`."""
    return min(max(speed / response, low), high)


@njit(cache=True, nogil=True)
def bounds(slot, joint, m, angle, speed):  # type: ignore[no-untyped-def]
    """Least and greatest torque of the dry friction in `slot`."""
    m[motion.ANGLE], m[motion.SPEED] = angle, speed
    m[motion.DIRECTION] = 1.0
    high = total(slot, joint, m)
    m[motion.DIRECTION] = -1.0
    low = -total(slot, joint, m)
    m[motion.DIRECTION] = 1.0 if speed >= 0 else -1.0
    return min(low, high), max(low, high)


@njit(cache=True, nogil=True)
def see(m, x, time, gear):  # type: ignore[no-untyped-def]
    """Write the joint's motion into `m`, seen from the output side."""
    m[motion.TIME] = time
    m[motion.ANGLE] = m[motion.JOINT_ANGLE] = x[0] + x[2]
    m[motion.SPEED] = x[1] + x[3]
    m[motion.GEAR], m[motion.MOTOR_TURN] = gear, gear * x[0]
    m[motion.WINDUP], m[motion.WINDUP_RATE] = x[2], x[3]
    m[motion.DIRECTION] = 1.0 if m[motion.SPEED] >= 0 else -1.0


@njit(cache=True, nogil=True)
def substep(joint, era, m, x, free, middle, effort, time, h, phi, gamma, phi_half, gamma_half, torques):  # type: ignore[no-untyped-def]
    """Advance `x` by one substep; `torques` carries factor, motor, output and spring torques to the next."""
    first = joint.first
    drive = era[DRIVE_GAIN] * effort
    advance(phi_half, gamma_half, x, torques[0] * drive + torques[3] - torques[1], -torques[3] - torques[2], middle)
    see(m, middle, time + 0.5 * h, joint.steps[GEAR])
    m[motion.STEP], m[motion.CURRENT], m[motion.STIFFNESS] = h, effort, era[SPRING_RATE]
    factor = product(TORQUE_CONSTANT, joint, m)
    spring, on_lever = 0.0, 0.0
    if first[WINDUP] < first[SPRING + 1]:
        m[motion.LEVER] = 1.0
        deflection = mapped(WINDUP, joint, m, middle[2])
        m[motion.WINDUP] = deflection
        spring = era[SPRING_RATE] * (deflection - middle[2]) + total(SPRING, joint, m)
        on_lever = (m[motion.LEVER] - 1.0) * (era[SPRING_RATE] * middle[2] + spring)
    m[motion.LOAD] = factor * drive if era[RIGID] > 0 else era[SPRING_RATE] * middle[2] + spring
    on_output = total(OUTPUT_TORQUE, joint, m)
    out_low, out_high = 0.0, 0.0
    if first[OUTPUT_DRY] < first[OUTPUT_DRY + 1]:
        out_low, out_high = bounds(OUTPUT_DRY, joint, m, m[motion.ANGLE], m[motion.SPEED])
    m[motion.ANGLE], m[motion.SPEED] = middle[0], middle[1]
    on_motor = total(MOTOR_TORQUE, joint, m) - on_lever
    advance(phi, gamma, x, factor * drive + spring - on_motor, -spring - on_output, free)
    dry_motor, dry_output = 0.0, 0.0
    if first[MOTOR_DRY] < first[MOTOR_DRY + 1]:
        low, high = bounds(MOTOR_DRY, joint, m, middle[0], middle[1])
        for _ in range(3 if out_high > out_low else 1):
            speed = free[1] - gamma[1, 1] * dry_output
            dry_motor = nearest_to_rest(speed, gamma[1, 0], low, high)
            speed = free[1] + free[3] - (gamma[1, 0] + gamma[3, 0]) * dry_motor
            dry_output = nearest_to_rest(speed, gamma[1, 1] + gamma[3, 1], out_low, out_high)
    elif out_high > out_low:
        dry_output = nearest_to_rest(free[1] + free[3], gamma[1, 1] + gamma[3, 1], out_low, out_high)
    for i in range(4):
        x[i] = free[i] - gamma[i, 0] * dry_motor - gamma[i, 1] * dry_output
    torques[0], torques[3] = factor, spring
    torques[1], torques[2] = on_motor + dry_motor, on_output + dry_output


@njit(cache=True, nogil=True)
def mean_held(time, effort, now, low, high):  # type: ignore[no-untyped-def]
    """Mean over [low, high] of the effort commanded up to event `now`, each value held until the next."""
    j = now
    while j > 0 and time[j] > low:
        j -= 1
    if high <= low:
        return effort[j]
    result, start = 0.0, low
    while start < high:
        end = high if j >= now else min(high, max(time[j + 1], start))
        result += effort[j] * (end - start)
        start = end
        j += 1
    return result / (high - low)


@njit(cache=True, nogil=True)
def travel(joint, era, a, m, x, work, clock, out, now, held):  # type: ignore[no-untyped-def]
    """Advance `x` from event `now` to the next. `work`: scratch vectors, then Φ and Γ and the step they fit."""
    span = clock.time[now + 1] - clock.time[now]
    if span <= 0.0:
        return
    longest = joint.steps[LONGEST_STEP]
    if joint.steps[WAVE] > 0:
        longest = min(longest, _PHASE_STEP / max(1e-12, abs(joint.steps[WAVE] * joint.steps[GEAR] * x[1])))
    count = min(max(1, math.ceil(span / longest - 1e-9)), 1000)
    h = span / count
    phi, gamma, phi_half, gamma_half = work[2:6], work[6:10, :2], work[10:14], work[14:18, :2]
    if abs(h - work[18, 0]) > 1e-8 * h:  # stamps in float64 differ by less
        transition(era, a, h, phi, gamma)
        transition(era, a, 0.5 * h, phi_half, gamma_half)
        work[18, 0] = h
    delayed = joint.first[DELAY] < joint.first[DELAY + 1]
    effort = held
    for i in range(count):
        time = clock.time[now] + i * h
        if delayed:
            m[motion.TIME] = time
            age = total(DELAY, joint, m)
            effort = mean_held(clock.time, out.effort, now, time - age, time + h - age)
        substep(joint, era, m, x, work[0], work[1], effort, time, h, phi, gamma, phi_half, gamma_half, work[19])


@njit(cache=True, nogil=True)
def sense(joint, m, x, clock, now, rigid, measured):  # type: ignore[no-untyped-def]
    """Write what the sensors give the controller: joint angle, and motor speed (joint speed of a rigid joint)."""
    see(m, x, clock.time[now], joint.steps[GEAR])
    measured[0] = mapped(POSITION_SENSOR, joint, m, x[0] + x[2])
    measured[1] = mapped(VELOCITY_SENSOR, joint, m, x[1] if rigid else joint.steps[GEAR] * x[1])
    for i in range(2):
        if clock.noise.shape[0] > 0:
            measured[i] += clock.noise[now, i]
        if clock.resolution[i] > 0:
            measured[i] = round(measured[i] / clock.resolution[i]) * clock.resolution[i]


@njit(cache=True, nogil=True)
def state_at(clock, out, now, time, x):  # type: ignore[no-untyped-def]
    """Write the motion at `time`, at or before event `now`, into `x`: cubic between events."""
    j = now
    while j > 0 and clock.time[j] > time:
        j -= 1
    if j == now or time <= clock.time[0]:
        x[:] = out.state[j, :4]
        return
    span = clock.time[j + 1] - clock.time[j]
    u = (time - clock.time[j]) / span
    for i in (0, 2):
        p, q = out.state[j, i], out.state[j + 1, i]
        v, w = span * out.state[j, i + 1], span * out.state[j + 1, i + 1]
        x[i] = p + u * (v + u * (3 * (q - p) - 2 * v - w + u * (2 * (p - q) + v + w)))
        x[i + 1] = (1 - u) * out.state[j, i + 1] + u * out.state[j + 1, i + 1]


@njit(cache=True, nogil=True)
def control(joint, clock, now, position, speed, memory):  # type: ignore[no-untyped-def]
    """Effort of the controller; `speed` is reflected to the output.

    `memory` keeps the integral part (trapezoidal), the error and the time of the last tick; NaN where there was none.
    """
    law = joint.controller
    error = clock.setpoint[now] - position
    integral = memory[0]
    if memory[2] < clock.time[now]:  # false of NaN: the integral part is then given for this very tick
        integral += 0.5 * law[KI] * (error + memory[1]) * (clock.time[now] - memory[2])
    effort = law[KP] * error + integral + clock.feedforward[now]
    effort += law[KD] * (law[RATE_FEEDFORWARD] * clock.rate[now] - speed)
    limited = min(max(effort, -law[LIMIT]), law[LIMIT])
    # Anti-windup: no further integration into a limit that already holds.
    if effort == limited or (effort - limited) * error < 0:
        memory[0] = integral
    memory[1], memory[2] = error, clock.time[now]
    return limited


@njit(cache=True, nogil=True)
def begin(joint, start, x, memory, torques):  # type: ignore[no-untyped-def]
    """Set the state: motion, integral part of the controller (NaN keeps it), fresh memories of terms."""
    x[:] = start[:4]
    if math.isfinite(start[4]):
        memory[0], memory[1], memory[2] = start[4], 0.0, np.nan
    joint.states[:] = np.nan
    torques[:] = 0.0
    torques[0] = 1.0


@njit(cache=True, nogil=True)
def record(joint, m, x, clock, now, rigid, measured, seen, out, sample):  # type: ignore[no-untyped-def]
    """Write what the log holds of a sample: what the sensors gave, or gave a while ago if stamps are late."""
    out.sensed[sample, 0], out.sensed[sample, 1] = measured[0], measured[1]
    if joint.first[LATENCY] < joint.first[LATENCY + 1]:
        state_at(clock, out, now, clock.time[now] - total(LATENCY, joint, m), seen)
        sense(joint, m, seen, clock, now, rigid, out.sensed[sample])
        see(m, x, clock.time[now], joint.steps[GEAR])


@njit(cache=True, nogil=True)
def correct(x, clock, now, gain, out, sample):  # type: ignore[no-untyped-def]
    """Observer: note the innovation of a sample and correct the state by it; masked values correct nothing."""
    for i in range(2):
        value = clock.position[now] if i == 0 else clock.velocity[now]
        out.innovation[sample, i] = value - out.sensed[sample, i]
        if math.isfinite(value):
            for n in range(4):
                x[n] += gain[n, i] * out.innovation[sample, i]


@njit(cache=True, nogil=True)
def run(joint, clock, mode, start, gain, restarts, out):  # type: ignore[no-untyped-def]
    """Replay one model. `start` and each row of `restarts`: state and the controller's integral part (NaN keeps it)."""
    m = np.zeros(QUANTITIES)
    work = np.zeros((20, 4))
    x, measured, seen, memory = np.empty(4), np.empty(2), np.empty(4), np.empty(3)
    a = np.empty((_ORDER + 1, 4, 4))
    begin(joint, start, x, memory, work[19])
    k, rigid = 0, joint.eras[0, RIGID] > 0
    series(joint.eras[0], a)
    ratio = 1.0 if rigid else joint.steps[GEAR]
    held, events = 0.0, clock.time.size
    for now in range(events):
        m[motion.TEMPERATURE] = clock.temperature[now]
        if k + 1 < joint.eras.shape[0] and clock.time[now] >= joint.eras[k + 1, FROM_TIME] - 1e-9:
            k += 1
            series(joint.eras[k], a)
            work[18, 0] = 0.0
        if clock.restart[now] >= 0:
            begin(joint, restarts[clock.restart[now]], x, memory, work[19])
        out.state[now, :4] = x
        sample = clock.record[now]
        sense(joint, m, x, clock, now, rigid, measured)
        if sample >= 0:
            record(joint, m, x, clock, now, rigid, measured, seen, out, sample)
        if sample >= 0 and mode >= PREDICT:
            correct(x, clock, now, gain, out, sample)
        known = mode == CLOSED_LOOP or math.isfinite(clock.position[now] + clock.velocity[now])
        if clock.tick[now] and known and mode in (CLOSED_LOOP, PREDICT_CONTROLLER):
            if mode == PREDICT_CONTROLLER:
                measured[0], measured[1] = clock.position[now], clock.velocity[now]
            held = control(joint, clock, now, measured[0], measured[1] / ratio, memory)
            held = mapped(CURRENT, joint, m, held)
        elif mode in (OPEN_LOOP, PREDICT) and math.isfinite(clock.effort[now]):
            held = mapped(CURRENT, joint, m, unmapped(CURRENT_SENSOR, joint, m, clock.effort[now]))
        out.effort[now], out.state[now, 4] = held, memory[0]
        if sample >= 0:
            out.sensed[sample, 2] = mapped(CURRENT_SENSOR, joint, m, held)
        if not abs(x[0]) + abs(x[1]) + abs(x[2]) + abs(x[3]) < 1e9:
            return now
        if now + 1 < events:
            travel(joint, joint.eras[k], a, m, x, work, clock, out, now, held)
    return events


@njit(cache=True, nogil=True)
def run_many(joints, clock, mode, starts, gains, restarts, state, effort, sensed, innovation):  # type: ignore[no-untyped-def]
    """Replay a batch of models under one clock; arrays are stacked. Returns how many events each one survived."""
    survived = np.empty(starts.shape[0], np.int64)
    for b in range(starts.shape[0]):
        joint = Joint(
            joints.eras[b],
            joints.controller[b],
            joints.steps[b],
            joints.address[b],
            joints.first[b],
            joints.params[b],
            joints.onset[b],
            joints.states[b],
        )
        out = Out(state[b], effort[b], sensed[b], innovation[b])
        survived[b] = run(joint, clock, mode, starts[b], gains[b], restarts[b], out)
    return survived
