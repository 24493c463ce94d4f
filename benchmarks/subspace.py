"""Subspace identification against its peers: one million samples, one input, two outputs, order 4, 20 block rows.

The peers: SLICOT's Cholesky route through ctrlsys, in blocks of 20,000 samples and in one block, and SIPPY's N4SID.
SIPPY keeps the whole Hankel matrix and is timed on fewer samples, in proportion. Angles are compared with those of a
QR decomposition of the whole matrix where memory allows. Run with BLAS held to one thread.
"""

import json
import platform
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np
from scipy import linalg

from gsfdi.joint import hold, matrices
from gsfdi.model import Plant
from gsfdi.subspace import angles, hankel_factor, moesp, observability
from gsfdi.types import Array

SAMPLES, ROWS, ORDER = 1_000_000, 20, 4
RESULTS = Path(__file__).parent / "results" / "subspace.json"


def data(samples: int, decibel: float, seed: int = 0) -> tuple[Array, Array, Array]:
    """Input, outputs and observability matrix of the paper's joint, its integrators leaking so that it may run free."""
    joint = matrices(Plant(400.0, 0.0011, 260.6, 130000.0, 0.4, 0.6))
    A, B = hold(joint.A, joint.effort[:, None], 0.01)
    A = 0.98 * A
    rng = np.random.default_rng(seed)
    u = rng.standard_normal((samples, 1))
    y, x = np.zeros((samples, 2)), np.zeros(4)
    for k in range(samples):
        y[k] = joint.C @ x
        x = A @ x + B[:, 0] * u[k, 0]
    scale = y.std(axis=0)
    noise = 10.0 ** (-decibel / 20.0) * rng.standard_normal(y.shape)
    return u, y / scale + noise, observability(A, joint.C / scale[:, None], ROWS)


def slicot(u: Array, y: Array, block: int) -> None:
    """SLICOT's IB01AD, Cholesky, connected blocks."""
    import ctrlsys

    edges = list(range(0, len(u), block))
    state = None
    for i, low in enumerate(edges):
        batch = "O" if len(edges) == 1 else "F" if i == 0 else "L" if i == len(edges) - 1 else "I"
        part = slice(low, low + block)
        ctrlsys.ib01ad("M", "C", "N", batch, "C" if batch != "O" else "N", "N", ROWS, 1, 2,
                       np.asfortranarray(u[part]), np.asfortranarray(y[part]), 0.0, -1.0)  # fmt: skip
        state = batch
    assert state in ("O", "L")


def sippy(u: Array, y: Array) -> None:
    from sippy_unipi import system_identification

    system_identification(y.T, u.T, "N4SID", SS_fixed_order=ORDER, SS_f=ROWS, SS_p=ROWS)


def best_of(run: Callable[[], object], times: int = 5) -> float:
    spent = []
    for _ in range(times):
        start = time.perf_counter()
        run()
        spent.append(time.perf_counter() - start)
    return min(spent)


def full_qr(u: Array, y: Array) -> Array:
    """Observability matrix from a QR decomposition of the whole reordered Hankel matrix."""
    w = np.column_stack([u, y]).T
    index = np.arange(2 * ROWS * 3).reshape(2 * ROWS, 3)
    past, future = index[:ROWS], index[ROWS:]
    order = np.concatenate([future[:, :1].ravel(), past[:, :1].ravel(), past[:, 1:].ravel(), future[:, 1:].ravel()])
    windows = np.lib.stride_tricks.sliding_window_view(w, 2 * ROWS, axis=1).transpose(1, 2, 0)
    R = linalg.qr(windows.reshape(len(windows), -1)[:, order], mode="r")[0][: len(order)]
    needed = ROWS * 4
    return linalg.svd(R[ROWS:needed, needed:].T, full_matrices=False)[0][:, :ORDER]


def main() -> None:
    print(f"python {platform.python_version()}, numpy {np.__version__}, ctrlsys {version('ctrlsys')}")
    u, y, truth = data(SAMPLES, 60.0)
    moesp(u[:4000], y[:4000], ROWS, ORDER)
    figures: dict[str, float | str | bool] = {"ctrlsys": version("ctrlsys"), "sippy_unipi": version("sippy_unipi")}
    figures["gsfdi_s"] = best_of(lambda: moesp(u, y, ROWS, ORDER))
    figures["slicot_blocks_s"] = best_of(lambda: slicot(u, y, 20_000))
    figures["slicot_one_block_s"] = best_of(lambda: slicot(u, y, SAMPLES), 3)
    few = 50_000
    figures["sippy_scaled_s"] = best_of(lambda: sippy(u[:few], y[:few]), 1) * SAMPLES / few
    found = moesp(u, y, ROWS, ORDER)
    part = 100_000
    whole = full_qr(u[:part], y[:part])
    figures["angle_to_full_qr"] = float(angles(whole, moesp(u[:part], y[:part], ROWS, ORDER).basis)[0])
    figures["angle_to_truth_60_db"] = float(angles(truth, found.basis)[0])
    clean_u, clean_y, clean = data(part, 180.0)
    rescued = moesp(clean_u, clean_y, ROWS, ORDER)
    figures["angle_to_truth_180_db"] = float(angles(clean, rescued.basis)[0])
    figures["fell_back_at_180_db"] = not rescued.fast
    figures["blocked_qr_s"] = best_of(lambda: hankel_factor(np.column_stack([u, y]).T, 2 * ROWS), 1)
    for name, value in figures.items():
        print(f"{name:24s} {value:.4g}" if isinstance(value, float) else f"{name:24s} {value}")
    RESULTS.parent.mkdir(exist_ok=True)
    RESULTS.write_text(json.dumps(figures, indent=1) + "\n")


if __name__ == "__main__":
    main()
