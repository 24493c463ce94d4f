"""The effort that flows from an event on: of the model's controller, or as it was recorded."""

import math

from gsfdi.replay import layout as at
from gsfdi.replay.compiling import compiled, inlined
from gsfdi.replay.laws import mapped, unmapped
from gsfdi.replay.sensors import sense_late


@inlined
def command(model, mode, m, v, states, clock, state, now, held, noise, resolution):  # type: ignore[no-untyped-def]
    """Effort that flows from event `now` on."""
    ratio = 1.0 if model[at.RIGID] > 0 else model[at.GEAR]
    if mode == at.CLOSED_LOOP:
        if clock[now, at.TICK] > 0:
            speed = v[at.SENSED, 1]
            if model[at.SPEED_AGE] > 0:
                sense_late(model, m, v, states, clock, state, now, model[at.SPEED_AGE], 0.0, noise, resolution)
                speed = v[at.LATE, 1]
            held = control(model, clock, now, v[at.SENSED, 0], speed / ratio, v)
            held = mapped(at.CURRENT, model, m, states, held)
    elif mode == at.PREDICT_CONTROLLER:
        if clock[now, at.TICK] > 0 and math.isfinite(clock[now, at.POSITION] + clock[now, at.VELOCITY]):
            held = control(model, clock, now, clock[now, at.POSITION], clock[now, at.VELOCITY] / ratio, v)
            held = mapped(at.CURRENT, model, m, states, held)
    elif math.isfinite(clock[now, at.EFFORT]):
        held = unmapped(at.CURRENT_SENSOR, model, m, states, recorded(clock, now, v[at.SHIFTED, 0]))
        held = mapped(at.CURRENT, model, m, states, held)
    return held


@compiled
def recorded(clock, now, early):  # type: ignore[no-untyped-def]
    """Effort on average from event `now` to the next, where each acts a part of a tick before or after its stamp."""
    effort = clock[now, at.EFFORT]
    beside = now + 1 if early > 0.0 else now - 1
    if early == 0.0 or beside < 0 or beside >= clock.shape[0] or not math.isfinite(clock[beside, at.EFFORT]):
        return effort
    span = abs(clock[beside, at.TIME] - clock[now, at.TIME])
    share = abs(early) / span if span > abs(early) else 1.0
    return effort + share * (clock[beside, at.EFFORT] - effort)


@inlined
def control(model, clock, now, position, speed, v):  # type: ignore[no-untyped-def]
    """Effort of the controller; `speed` is reflected to the output.

    MEMORY keeps the integral part (trapezoidal), the error and the time of the last tick; NaN where there was none.
    """
    error = clock[now, at.SETPOINT] - position
    integral = v[at.MEMORY, 0]
    if v[at.MEMORY, 2] < clock[now, at.TIME]:  # false of NaN: the integral part is then given for this very tick
        integral += 0.5 * model[at.KI] * (error + v[at.MEMORY, 1]) * (clock[now, at.TIME] - v[at.MEMORY, 2])
    effort = model[at.KP] * error + integral + clock[now, at.FEEDFORWARD]
    effort += model[at.KD] * (model[at.RATE_FEEDFORWARD] * clock[now, at.RATE] - speed)
    limited = min(max(effort, -model[at.LIMIT]), model[at.LIMIT])
    # Anti-windup: no further integration into a limit that already holds.
    if effort == limited or (effort - limited) * error < 0:
        v[at.MEMORY, 0] = integral
    v[at.MEMORY, 1], v[at.MEMORY, 2] = error, clock[now, at.TIME]
    return limited
