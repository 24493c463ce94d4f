"""Semi-blind on real data: one term that a real recording certainly holds is withheld from its nominal model.

The recordings are those of the EMPS drive, found by the environment variable ``GSFDI_REAL`` (a folder that holds
``emps/emps.parquet``); without it there is nothing to do. The nominal models come from our own least squares on that
recording, so that no published number enters.
"""

import os
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import tomli_w
from scipy.signal import filtfilt, firwin, savgol_filter

from gsfdi.types import Array

CONTROLLER = {
    "type": "pid",
    "proportional_n_m": 1370728.5,
    "integral_n_ms": 0.0,
    "derivative_ns_m": 8557.43,
    "rate_feedforward": 0.0,
    "sample_rate_hz": 1000.0,
}
"""Published with the recordings."""

COVERS = {
    "coulomb_friction": ("coulomb_friction",),
    "viscous_friction": ("viscous_friction",),
    "asymmetric_friction": ("asymmetric_friction", "constant_load"),
}
"""Names that are right for each withheld term; an offset is the same as an asymmetry of dry friction."""


def home() -> Path | None:
    """Folder of the EMPS recordings, if there is one."""
    folder = Path(os.environ.get("GSFDI_REAL", "")) / "emps"
    return folder if (folder / "emps.parquet").is_file() else None


def trials(folder: Path) -> Iterator[tuple[str, Mapping[str, bytes]]]:
    """Give every withheld term with the files that the tool is given: recording and the model that lacks it."""
    recording = (folder / "emps.parquet").read_bytes()
    mass, fitted = friction(folder / "emps.parquet")
    for withheld in COVERS:
        physics = [entry for entry in fitted if entry["term"] != withheld]
        document = {
            "schema": "gsfdi/model/1",
            "name": "emps",
            "structure": "rigid",
            "axis": "linear",
            "plant": {"moving_mass_kg": mass},
            "controller": CONTROLLER,
            "physics": physics,
        }
        yield withheld, {"recording.parquet": recording, "nominal.toml": tomli_w.dumps(document).encode()}


def friction(path: Path) -> tuple[float, list[dict[str, object]]]:
    """Mass, dry and viscous friction with their asymmetry, by least squares on the filtered force balance."""
    table = pq.read_table(path)
    position, force = (np.asarray(table.column(name), dtype=float) for name in ("position_m", "drive_force_n"))
    step = 1e-3
    low = firwin(201, 60.0, fs=1.0 / step)
    speed, change = (_smooth(low, savgol_filter(position, 21, 3, deriv=k, delta=step)) for k in (1, 2))
    force = _smooth(low, force)
    moving = np.abs(speed) > 5e-3
    moving[:200] = moving[-200:] = False
    sign = np.sign(speed)
    table_ = np.column_stack([change, speed, sign, 0.5 * np.ones(speed.size), 0.5 * np.abs(speed)])
    mass, viscous, dry, dry_difference, wet_difference = np.linalg.lstsq(table_[moving], force[moving], rcond=None)[0]
    physics: list[dict[str, object]] = [
        {"term": "viscous_friction", "coefficient_ns_m": float(viscous)},
        {"term": "coulomb_friction", "torque_n": float(dry)},
        {
            "term": "asymmetric_friction",
            "difference_n": float(dry_difference),
            "difference_ns_m": float(wet_difference),
        },
    ]
    return float(mass), physics


def _smooth(low: Array, values: Array) -> Array:
    smooth: Array = filtfilt(low, [1.0], values)
    return smooth
