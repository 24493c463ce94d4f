"""What the sensors give of a motion, and what a log holds of that."""

import math

import numpy as np

from gsfdi.replay import layout as at
from gsfdi.replay.compiling import compiled, inlined
from gsfdi.replay.laws import any_in, mapped, see, total, unmapped


@inlined
def sense(model, m, v, states, row, target, time, noise, resolution, now):  # type: ignore[no-untyped-def]
    """Write into row `target` what sensors give of row `row`: joint angle; motor speed (joint speed if rigid)."""
    see(model, m, v, row, time)
    v[target, 0] = v[row, 0] + v[row, 2]
    v[target, 1] = v[row, 1] if model[at.RIGID] > 0 else model[at.GEAR] * v[row, 1]
    for i in range(2):  # what a sensor reads in steps, or out of scale, has its noise in it
        if noise.shape[0] > 0:
            v[target, i] += noise[now, i]
    v[target, 0] = mapped(at.POSITION_SENSOR, model, m, states, v[target, 0])
    v[target, 1] = mapped(at.VELOCITY_SENSOR, model, m, states, v[target, 1])
    for i in range(2):
        if resolution[i] > 0:
            v[target, i] = round(v[target, i] / resolution[i]) * resolution[i]


@inlined
def sense_late(model, m, v, states, clock, state, now, age, lag, noise, resolution):  # type: ignore[no-untyped-def]
    """Write into row LATE what sensors gave `age` before event `now`, the speed by `lag` more, with noise of then."""
    then = motion_at(clock, state, now, clock[now, at.TIME] - age, v)
    if lag > 0.0:
        v[at.SEEN, 1] = speed_at(clock, state, now, clock[now, at.TIME] - age - lag)
    sense(model, m, v, states, at.SEEN, at.LATE, clock[now, at.TIME], noise, resolution, then)
    see(model, m, v, at.X, clock[now, at.TIME])


@compiled
def motion_at(clock, state, now, time, v):  # type: ignore[no-untyped-def]
    """Write the motion at `time`, no later than event `now`, into row SEEN: cubic between events; give the earlier."""
    j = now
    while j > 0 and clock[j, at.TIME] > time:
        j -= 1
    last = min(j + 1, now)
    span = clock[last, at.TIME] - clock[j, at.TIME]
    u = 0.0 if span <= 0.0 or time <= clock[0, at.TIME] else (time - clock[j, at.TIME]) / span
    for i in (0, 2):
        a, b = state[j, i], state[last, i]
        da, db = span * state[j, i + 1], span * state[last, i + 1]
        square, cube = 3 * (b - a) - 2 * da - db, 2 * (a - b) + da + db
        v[at.SEEN, i] = a + u * (da + u * (square + u * cube))
        v[at.SEEN, i + 1] = state[j, i + 1] if span <= 0.0 else (da + u * (2 * square + 3 * u * cube)) / span
    return j


@compiled
def speed_at(clock, state, now, time):  # type: ignore[no-untyped-def]
    """Motor's speed at `time`, no later than event `now`: straight between events, as an observer has corrected it."""
    j = now
    while j > 0 and clock[j, at.TIME] > time:
        j -= 1
    last = min(j + 1, now)
    span = clock[last, at.TIME] - clock[j, at.TIME]
    u = 0.0 if span <= 0.0 else max(time - clock[j, at.TIME], 0.0) / span
    begun = state[j, at.CORRECTED if j < now else 1]
    return begun + u * (state[last, at.CORRECTED if last < now else 1] - begun)


@inlined
def show(model, mode, m, v, states, clock, now, noise, resolution, gain, state, shown):  # type: ignore[no-untyped-def]
    """Write what the log holds of a sample, which late stamps make older; an observer corrects its state by it."""
    sample, source = int(clock[now, at.RECORD]), at.SENSED
    if any_in(at.LATENCY, model) or any_in(at.SPEED_LATENCY, model):
        age, lag = total(at.LATENCY, model, m, states), total(at.SPEED_LATENCY, model, m, states)
        sense_late(model, m, v, states, clock, state, now, age, lag, noise, resolution)
        source = at.LATE
    if v[at.SHIFTED, 0] != 0.0 and now > 0 and clock[now, at.TIME] > clock[now - 1, at.TIME]:
        change = (v[at.X, 1] - state[now - 1, at.CORRECTED]) / (clock[now, at.TIME] - clock[now - 1, at.TIME])
        v[source, 1] -= (1.0 if model[at.RIGID] > 0 else model[at.GEAR]) * v[at.SHIFTED, 0] * change
    for i in range(2):
        shown[sample, i] = v[source, i]
        shown[sample, at.INNOVATION + i] = np.nan
        if mode >= at.PREDICT:
            shown[sample, at.INNOVATION + i] = clock[now, at.POSITION + i] - v[source, i]
            if i == 1 and clock[now, at.LEVER] > 0:  # the speed was told by an effort that its sensor shows otherwise
                effort = clock[now, at.EFFORT]
                effort += v[at.MEMORY, 0] - unmapped(at.CURRENT_SENSOR, model, m, states, effort)
                shown[sample, at.INNOVATION + i] += clock[now, at.LEVER] * effort
            if math.isfinite(clock[now, at.POSITION + i]):
                for n in range(4):
                    jump = gain[n, i] * shown[sample, at.INNOVATION + i]
                    v[at.X, n] += jump
                    v[at.JUMPED, n] += jump
