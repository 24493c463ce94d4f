"""The kernel itself: from event to event through one model, or a batch of them."""

import math
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from gsfdi import motion
from gsfdi.replay import layout as at
from gsfdi.replay.compiling import SOURCES, compiled, inlined, stamp
from gsfdi.replay.controller import command
from gsfdi.replay.flow import MATRICES, series
from gsfdi.replay.laws import mapped
from gsfdi.replay.sensors import sense, show
from gsfdi.replay.travel import travel
from gsfdi.types import Array


@compiled
def begin(start, row, m, v, states):  # type: ignore[no-untyped-def]
    """Set the state: motion, integral part of the controller (NaN keeps it), fresh memories of terms."""
    m[motion.BEGUN] = start[row, at.STRETCHED] if start.shape[1] > at.STRETCHED else 0.0
    m[motion.SWING] = start[row, at.SWING] if start.shape[1] > at.SWING else 0.0
    m[motion.SWING_RATE] = start[row, at.SWING_RATE] if start.shape[1] > at.SWING_RATE else 0.0
    for i in range(4):
        v[at.X, i] = start[row, i]
        v[at.TORQUES, i] = v[at.JUMPED, i] = 0.0
    v[at.TORQUES, 0] = 1.0
    if math.isfinite(start[row, at.INTEGRAL]):
        v[at.MEMORY, 0], v[at.MEMORY, 1], v[at.MEMORY, 2] = start[row, at.INTEGRAL], 0.0, np.nan
    for i in range(states.size):
        states[i] = np.nan


@compiled
def blank(clock, now, state, shown):  # type: ignore[no-untyped-def]
    """Write not-a-number from event `now` on, where the model has run away."""
    for k in range(now, clock.shape[0]):
        for i in range(at.STATE_WIDTH):
            state[k, i] = np.nan
        for i in range(at.SHOWN_WIDTH if clock[k, at.RECORD] >= 0 else 0):
            shown[int(clock[k, at.RECORD]), i] = np.nan


@compiled
def lay_out(model, era, powers):  # type: ignore[no-untyped-def]
    """Lay out the series of an era's plant, and of the same without its spring where the gearbox has a play."""
    series(model, era, model[era + at.SPRING_RATE], powers[0])
    if model[at.PLAY] > 0:
        series(model, era, 0.0, powers[1])


@inlined
def run(  # type: ignore[no-untyped-def]
    model, clock, noise, resolution, mode, start, gain, restarts, state, shown, m, v, flow, powers, states
):
    """Replay one model.

    `start` (1, 5 to 9) and `restarts` (k, 5) hold motion, the integral part and what else `layout` says of a start;
    `state` and `shown` are filled; what follows them is scratch (see `scratch`).
    """
    v[at.MEMORY, 0], v[at.MEMORY, 2] = 0.0, np.nan
    v[at.FITTED, 0] = v[at.FITTED, 1] = 0.0
    v[at.SHIFTED, 0] = start[0, at.SHIFT] if start.shape[1] > at.SHIFT else 0.0
    begin(start, 0, m, v, states)
    era, last_era = at.ERA_ROWS, at.ERA_ROWS + (int(model[at.ERAS]) - 1) * at.ERA_WIDTH
    lay_out(model, era, powers)
    held, events = 0.0, clock.shape[0]
    for now in range(events):
        time = clock[now, at.TIME]
        m[motion.TEMPERATURE] = clock[now, at.TEMPERATURE]
        if era < last_era and time >= model[era + at.ERA_WIDTH + at.FROM_TIME] - 1e-9:
            era += at.ERA_WIDTH
            lay_out(model, era, powers)
            v[at.FITTED, 0] = v[at.FITTED, 1] = 0.0
        if clock[now, at.RESTART] >= 0:
            begin(restarts, int(clock[now, at.RESTART]), m, v, states)
        for i in range(4):
            state[now, i] = v[at.X, i]
        sense(model, m, v, states, at.X, at.SENSED, time, noise, resolution, now)
        if clock[now, at.RECORD] >= 0:
            show(model, mode, m, v, states, clock, now, noise, resolution, gain, state, shown)
        state[now, at.CORRECTED] = v[at.X, 1]
        held = command(model, mode, m, v, states, clock, state, now, held, noise, resolution)
        state[now, at.INTEGRAL], state[now, at.FLOWING] = v[at.MEMORY, 0], held
        if clock[now, at.RECORD] >= 0:
            shown[int(clock[now, at.RECORD]), at.SHOWN_EFFORT] = mapped(at.CURRENT_SENSOR, model, m, states, held)
        if not abs(v[at.X, 0]) + abs(v[at.X, 1]) + abs(v[at.X, 2]) + abs(v[at.X, 3]) < 1e9:
            blank(clock, now, state, shown)
            break
        if now + 1 < events:
            travel(model, era, powers, m, v, states, flow, clock, state, now)


def run_many_of(sources: int) -> Any:
    """Make the kernel's entry.

    numba compiles a cached function anew when its own file changes, or what its closure holds. The kernel has several
    files, so their stamp, `sources`, is in its closure.
    """

    @njit(cache=True, nogil=True, _nrt=False)
    def run_many(  # type: ignore[no-untyped-def]
        models, clock, noise, resolution, mode, starts, gains, restarts, state, shown, m, v, flow, powers, states
    ):
        """Replay a batch: one row of every array per model, the scratch shared."""
        _ = sources
        for b in range(models.shape[0]):
            run(models[b], clock, noise, resolution, mode, starts[b], gains[b], restarts[b], state[b], shown[b],
                m, v, flow, powers, states)  # fmt: skip

    return run_many


run_many = run_many_of(stamp())


def scratch(terms: int) -> tuple[Array, Array, Array, Array, Array]:
    """Room for the motion vector, state vectors, Φ and Γ, the exponentials' series, and twice the states of `terms`."""
    return (
        np.zeros(motion.QUANTITIES),
        np.zeros((at.VECTORS, 4)),
        np.zeros((8, 6, 4)),
        np.zeros((2, MATRICES, 4, 4)),
        np.zeros(2 * (motion.STATES * terms + 1)),
    )


def is_compiled() -> bool:
    """Whether numba's cache holds the kernel as its files now are."""
    newest = max(path.stat().st_mtime for path in SOURCES)
    saved = Path(run_many.stats.cache_path).glob(f"{Path(__file__).stem}.*.nbi")
    return any(index.stat().st_mtime >= newest for index in saved)
