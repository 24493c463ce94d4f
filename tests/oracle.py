"""A slow, obvious joint: scipy's adaptive integration with events for stick and slip, contact and gap.

It shares no code with the simulator. Between two ticks of the controller the joint is in one mode (motor and output
each sliding forward, backward or stuck; teeth on either flank or in the gap), integrated to 1e-11 up to the event that
ends it.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

from gsfdi.model import Controller, Plant

Array = npt.NDArray[np.float64]


def none(_angle: float, _speed: float) -> float:
    return 0.0


@dataclass
class Oracle:
    """Flexible joint with dry friction on either side, smooth resisting torques, and a spring law of pieces."""

    plant: Plant
    motor_dry: Callable[[float, float], float] = none  # level from angle and speed
    output_dry: Callable[[float, float], float] = none
    motor_torque: Callable[[float, float], float] = none
    output_torque: Callable[[float, float], float] = none
    half_gap: float = 0.0
    stop: float = np.inf
    stop_stiffness: float = 0.0
    mode: list[int] = field(default_factory=lambda: [0, 0])

    def spring(self, windup: float) -> float:
        return self.plant.stiffness * (windup - min(max(windup, -self.half_gap), self.half_gap))

    def loads(self, x: Array, drive: float) -> tuple[float, float]:
        """Torque on motor and output before dry friction."""
        angle = x[0] + x[2]
        spring = self.spring(x[2])
        end = self.stop_stiffness * max(0.0, angle - self.stop)
        motor = drive + spring - self.motor_torque(x[0], x[1])
        output = -spring - self.plant.damping * (x[1] + x[3]) - self.output_torque(angle, x[1] + x[3]) - end
        return motor, output

    def rate(self, _t: float, x: Array, drive: float) -> Array:
        p = self.plant
        motor, output = self.loads(x, drive)
        motor -= self.mode[0] * self.motor_dry(x[0], x[1])
        output -= self.mode[1] * self.output_dry(x[0] + x[2], x[1] + x[3])
        stuck_motor, stuck_output = self.has(self.motor_dry, 0), self.has(self.output_dry, 1)
        a = 0.0 if stuck_motor else motor / (p.gear_ratio**2 * p.motor_inertia)
        b = 0.0 if stuck_output else output / p.output_inertia
        return np.array([x[1], a, x[3], b - a])

    def has(self, dry: Callable[[float, float], float], side: int) -> bool:
        return dry is not none and self.mode[side] == 0

    def settle(self, x: Array, drive: float) -> None:
        """Choose the mode that fits the state."""
        loads = self.loads(x, drive)
        for side, (dry, angle, speed) in enumerate(
            ((self.motor_dry, x[0], x[1]), (self.output_dry, x[0] + x[2], x[1] + x[3]))
        ):
            if dry is none:
                continue
            if abs(speed) > 1e-13:
                self.mode[side] = int(np.sign(speed))
            else:
                self.mode[side] = int(np.sign(loads[side])) if abs(loads[side]) > dry(angle, 0.0) else 0

    def events(self, x: Array, drive: float) -> list[tuple[str, Callable[[float, Array], float]]]:
        """Functions that fall through zero where the present mode ends."""
        found: list[tuple[str, Callable[[float, Array], float]]] = []
        for side, (dry, speed, angle) in enumerate(
            ((self.motor_dry, lambda x: x[1], lambda x: x[0]), (self.output_dry, lambda x: x[1] + x[3], angle_of))
        ):
            if dry is none:
                continue
            way = self.mode[side]
            if way:
                found.append((f"rest {side}", lambda _t, x, w=way, s=speed: w * s(x)))
            else:
                found.append(
                    (f"slip {side}", lambda _t, x, i=side, a=angle, d=dry: d(a(x), 0.0) - abs(self.loads(x, drive)[i]))
                )
        for name, value, edge in (
            ("gap", lambda x: x[2], self.half_gap),
            ("gap", lambda x: x[2], -self.half_gap),
            ("stop", angle_of, self.stop),
        ):
            if (name == "gap" and self.half_gap) or (name == "stop" and np.isfinite(edge)):
                above = 1.0 if value(x) > edge else -1.0
                found.append((name, lambda _t, x, w=above, v=value, e=edge: w * (v(x) - e)))
        return found

    def advance(self, x: Array, drive: float, span: float) -> Array:
        """Integrate over `span` seconds under a constant drive torque, event by event."""
        now = 0.0
        for _ in range(100):
            self.settle(x, drive)
            names, events = zip(*self.events(x, drive), strict=True) if self.events(x, drive) else ((), ())
            for event in events:
                event.terminal, event.direction = True, -1.0
            sol = solve_ivp(
                lambda t, y: self.rate(t, y, drive), (now, span), x, "DOP853", rtol=1e-11, atol=1e-15, events=events
            )
            x, now = sol.y[:, -1].copy(), sol.t[-1]
            if sol.status != 1:
                return x
            for name, hit in zip(names, sol.t_events, strict=True):
                x = self.past(name, x, drive) if hit.size else x
        raise AssertionError("too many events")

    def past(self, name: str, x: Array, drive: float) -> Array:
        """Put the state just past the event called `name`."""
        x = x.copy()
        kind, _, side = name.partition(" ")
        if kind == "rest":  # the speed is zero now, and the mode is chosen anew
            x[3], x[1] = (x[3] + x[1], 0.0) if side == "0" else (-x[1], x[1])
        elif kind == "slip":
            push = 1e-12 * np.sign(self.loads(x, drive)[int(side)])
            x[1], x[3] = (x[1] + push, x[3] - push) if side == "0" else (x[1], x[3] + push)
        elif kind == "gap":
            x[2] += 1e-14 * np.sign(x[3])
        else:
            x[0] += 1e-14 * np.sign(x[1] + x[3])
        return x


def angle_of(x: Array) -> float:
    return float(x[0] + x[2])


def closed_loop(oracle: Oracle, law: Controller, setpoint: Array, rate: Array, dt: float) -> tuple[Array, Array]:
    """State (n, 4) at every tick of a controller that starts at rest, and its effort (n,)."""
    x, integral, before = np.array([setpoint[0], 0.0, 0.0, 0.0]), 0.0, None
    states, efforts = [], []
    gain = oracle.plant.gear_ratio * oracle.plant.torque_constant
    for r, rr in zip(setpoint, rate, strict=True):
        error = r - x[0] - x[2]
        integral += 0.0 if before is None else law.integral * 0.5 * (error + before) * dt
        before = error
        effort = law.proportional * error + integral + law.derivative * (law.rate_feedforward * rr - x[1])
        effort = min(max(effort, -law.limit), law.limit)
        states.append(x)
        efforts.append(effort)
        x = oracle.advance(x, gain * effort, dt)
    return np.array(states), np.array(efforts)
