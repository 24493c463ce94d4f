"""The plots of a page against matplotlib's: time and bytes, the same curves, by turns in one process.

A page of seven joints has some 35 plots; each curve here is a minute at 100 Hz, noisy, with a threshold. Importing
counts, as it is paid by every run of the command.
"""

import json
import subprocess
import sys
import time
from io import StringIO
from pathlib import Path

import matplotlib
import matplotlib.pyplot as plt
import numpy as np

from gsfdi.svg import Level, Line, Plot, draw

PLOTS = 35
T = np.arange(6000) * 0.01
CURVES = np.sin(T) + 0.1 * np.random.default_rng(1).normal(size=(PLOTS, T.size))


def ours(curve: np.ndarray) -> str:
    return draw(Plot("curve", "a noisy curve", (Line(T, curve, "signal"), Level(1.0, "threshold"))))


def theirs(curve: np.ndarray) -> str:
    figure, axes = plt.subplots(figsize=(5.6, 1.7))
    axes.plot(T, curve, label="signal")
    axes.axhline(1.0, linestyle="--")
    axes.set_xlabel("time [s]")
    text = StringIO()
    figure.savefig(text, format="svg")
    plt.close(figure)
    return text.getvalue()


def importing(module: str) -> float:
    """Processor time of importing `module` into a process that has numpy."""
    code = f"import time, numpy; t = time.process_time(); import {module}; print(time.process_time() - t)"
    return min(
        float(subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, text=True).stdout)
        for _ in range(3)
    )


def main() -> None:
    matplotlib.use("svg")
    spent, written = {"gsfdi": 0.0, "matplotlib": 0.0}, {"gsfdi": 0, "matplotlib": 0}
    for curve in CURVES:
        for name, drawn in (("gsfdi", ours), ("matplotlib", theirs)):
            began = time.process_time()
            written[name] += len(drawn(curve).encode())
            spent[name] += time.process_time() - began
    rows = {
        name: {
            "import_s": importing(module),
            f"{PLOTS}_plots_s": spent[name],
            "bytes_per_plot": written[name] // PLOTS,
        }
        for name, module in (("gsfdi", "gsfdi.svg"), ("matplotlib", "matplotlib.pyplot"))
    }
    result = {"matplotlib_version": matplotlib.__version__, "rows": rows}
    (Path(__file__).parent / "results" / "drawing.json").write_text(json.dumps(result, indent=1) + "\n")
    print(json.dumps(result, indent=1))


if __name__ == "__main__":
    main()
