"""The simulator against scipy and MuJoCo on one joint: how fast, and how far apart their answers are.

A minute of closed loop at 1 kHz with a bristle (presliding) friction on the motor; each engine integrates the same
joint under the same sampled controller. The slow ones run a part of the minute; every figure is processor time per
simulated second, the engines by turns so that what else the machine does falls on all. Run it alone for figures worth
keeping.
"""

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import control
import mujoco
import numpy as np
import numpy.typing as npt
from scipy.integrate import solve_ivp

from gsfdi.model import JointModel, TermUse
from gsfdi.modelfile import load_models
from gsfdi.simulate import Drive, Signals, Start, drive_from, replay, replay_many

Array = npt.NDArray[np.float64]
HERE = Path(__file__).parent
ERA = load_models(HERE.parent / "configs" / "era_joint.toml").for_joint("era")
FRICTION, BRISTLES = 4.0, 20000.0  # [N m], [N m/rad]
BRISTLE = TermUse("presliding_friction", {"torque_nm": FRICTION, "stiffness_nm_rad": BRISTLES}, "motor")
assert ERA.controller is not None
LAW = replace(ERA.controller, sample_rate=1000.0, integral=0.0)
MODEL = replace(ERA, controller=LAW, physics=(BRISTLE,))
J, C = ERA.plant.gear_ratio**2 * ERA.plant.motor_inertia, ERA.plant.stiffness
GAIN = ERA.plant.gear_ratio * ERA.plant.torque_constant


def commanded(rate: float, seconds: float, model: JointModel) -> Drive:
    t = np.arange(round(rate * seconds)) / rate
    setpoint = 0.2 * np.sin(2 * np.pi * t / 12) * (1 - np.exp(-t / 3))
    blank = np.full(t.size, np.nan)
    signals = Signals(t, setpoint, np.gradient(setpoint, t), 0 * t, blank, blank, blank, 0 * t + 20)
    return drive_from(signals, model, Start(0, 0, 0, 0, 0))


def best(work: Callable[[], object], times: int) -> float:
    """Least processor time of several runs [s]."""
    took = []
    for _ in range(times):
        begin = time.process_time()
        work()
        took.append(time.process_time() - begin)
    return min(took)


def effort(drive: Drive, k: int, position: float, speed: float) -> float:
    error = drive.signals.setpoint[k] - position
    return float(LAW.proportional * error + LAW.derivative * (drive.signals.setpoint_rate[k] - speed))


def by_scipy(drive: Drive, tolerance: float) -> Array:
    def rate(_t: float, x: Array, torque: float) -> list[float]:
        speed, windup, twist, bristle = x[1], x[2], x[3], x[4]
        accel = (torque + C * windup - FRICTION * bristle) / J
        link = (-ERA.plant.damping * (speed + twist) - C * windup) / ERA.plant.output_inertia
        slip = BRISTLES / FRICTION * (speed - abs(speed) * bristle)
        return [speed, accel, twist, link - accel, slip]

    x, positions = np.zeros(5), []
    for k in range(drive.t.size):
        positions.append(x[0] + x[2])
        torque = GAIN * effort(drive, k, x[0] + x[2], x[1])
        x = solve_ivp(rate, (0.0, 1e-3), x, "RK45", args=(torque,), rtol=tolerance, atol=1e-4 * tolerance).y[:, -1]
    return np.array(positions)


MASSLESS = '<inertial pos="0 0 0" mass="1e-6" diaginertia="1e-9 1e-9 1e-9"/>'
SCENE = f"""
<mujoco><option timestep="0.001" gravity="0 0 0" integrator="implicitfast"/><worldbody>
<body><joint name="motor" axis="0 0 1" armature="{J}"/>{MASSLESS}
<body><joint name="windup" axis="0 0 1" stiffness="{C}"/>
<inertial pos="0 0 0" mass="1" diaginertia="400 400 400"/></body>
</body></worldbody><actuator><motor joint="motor"/>
<dcmotor joint="motor" input="none" motorconst="1e-6" resistance="1" lugre="{BRISTLES} 0 {FRICTION} {FRICTION} 1"/>
</actuator></mujoco>
"""


def by_mujoco(drive: Drive) -> Array:
    model = mujoco.MjModel.from_xml_string(SCENE)
    data = mujoco.MjData(model)
    positions = np.empty(drive.t.size)
    for k in range(drive.t.size):
        position = data.qpos[0] + data.qpos[1]
        positions[k] = position
        data.ctrl[0] = GAIN * effort(drive, k, position, data.qvel[0])
        mujoco.mj_step(model, data)
    return positions


def by_control(drive: Drive) -> Array:
    """The linear joint alone, open loop: what a linear toolbox does in the time."""
    drag = ERA.plant.damping / ERA.plant.output_inertia
    pull = C / J + C / ERA.plant.output_inertia
    a = [[0, 1, 0, 0], [0, 0, C / J, 0], [0, 0, 0, 1], [0, -drag, -pull, -drag]]
    system = control.ss(a, [[0], [GAIN / J], [0], [-GAIN / J]], [[1, 0, 1, 0]], 0)
    return np.asarray(control.forced_response(system, drive.t, np.sin(drive.t)).outputs)


def start_up() -> dict[str, float]:
    """Seconds of the first simulation after installation and of a later process, the interpreter's own included."""
    code = "from benchmarks.simulator import *; replay(MODEL, commanded(1000.0, 1.0, MODEL))"
    took = {}
    with tempfile.TemporaryDirectory() as cache:
        env = os.environ | {"NUMBA_CACHE_DIR": cache}
        for name in ("first call compiles [s]", "a later process [s]"):
            begin = time.perf_counter()
            subprocess.run([sys.executable, "-c", code], cwd=HERE.parent, env=env, check=True)
            took[name] = time.perf_counter() - begin
    bare = time.perf_counter()
    subprocess.run([sys.executable, "-c", code.split(";")[0]], cwd=HERE.parent, check=True)
    took["of which the imports of this benchmark [s]"] = time.perf_counter() - bare
    return took


def speeds() -> dict[str, dict[str, float]]:
    """Processor time per simulated second, ratio to ours, and distance of the positions from tight integration."""
    minute, part, few = (commanded(1000.0, seconds, MODEL) for seconds in (60.0, 20.0, 3.0))
    works: dict[str, tuple[Callable[[], object], float]] = {
        "gsfdi": (lambda: replay(MODEL, minute), 60.0),
        "scipy solve_ivp, rtol 1e-9": (lambda: by_scipy(few, 1e-9), 3.0),
        "scipy solve_ivp, rtol 1e-6": (lambda: by_scipy(few, 1e-6), 3.0),
        "scipy solve_ivp, rtol 1e-3 (its default)": (lambda: by_scipy(few, 1e-3), 3.0),
        "mujoco": (lambda: by_mujoco(part), 20.0),
        "control, linear only": (lambda: by_control(part), 20.0),
    }
    costs = dict.fromkeys(works, np.inf)
    for _ in range(3):
        for name, (work, seconds) in works.items():
            costs[name] = min(costs[name], best(work, 10 if name == "gsfdi" else 1) / seconds)
    exact = by_scipy(few, 1e-11)
    found = {"gsfdi": replay(MODEL, few).position, "mujoco": by_mujoco(few)}
    found |= {name: by_scipy(few, float(name.split()[3])) for name in works if "rtol" in name}
    return {
        name: {
            "processor seconds per simulated second": cost,
            "times slower than gsfdi": cost / costs["gsfdi"],
            "times real time": 1 / cost,
            **({"farthest from tight [rad]": float(np.max(np.abs(found[name] - exact)))} if name in found else {}),
        }
        for name, cost in costs.items()
    }


def calls() -> dict[str, float]:
    """Milliseconds per call for what a fit asks ten thousand times: 180 s at 100 Hz."""
    drive = commanded(100.0, 180.0, ERA)
    dry = TermUse("coulomb_friction", {"torque_nm": 2.0}, "motor")
    gap = TermUse("backlash", {"half_width_rad": 1e-3})
    models = {"linear": ERA, "coulomb": replace(ERA, physics=(dry,))}
    models["coulomb and backlash"] = replace(ERA, physics=(dry, gap))
    found = {name: 1e3 * best(lambda m=model: replay(m, drive), 20) for name, model in models.items()}
    batch = [replace(ERA, physics=(replace(dry, values={"torque_nm": 0.01 * i}),)) for i in range(100)]
    return found | {"coulomb, in a batch of 100": 1e3 * best(lambda: replay_many(batch, drive), 3) / 100}


if __name__ == "__main__":
    found = {"speed": speeds(), "180 s at 100 Hz [ms per call]": calls(), "start": start_up()}
    (HERE / "results").mkdir(exist_ok=True)
    (HERE / "results" / "simulator.json").write_text(json.dumps(found, indent=1) + "\n")
    print(json.dumps(found, indent=1))
