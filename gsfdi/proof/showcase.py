"""One case told in full: a joint whose position looks perfect and whose current gives it away, before and after.

It is chosen once the seal is opened, among the causes that were named right, as the one that hides best: the greatest
change of effort, in noise, for its change of the tracking error. The stored answers hold no curves, so the tool is
asked the same question once more.
"""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from gsfdi import ingest
from gsfdi.modelfile import load_models
from gsfdi.reconcile import Reconciliation, reconcile

MOST = 1200
"""Samples of a curve that are kept."""
PERFECT = 0.01
"""Relative change of the tracking error below which a position looks perfect."""


def showcase(
    scores: Mapping[str, Mapping[str, Any]],
    truths: Mapping[str, Mapping[str, Any]],
    files_of: Callable[[str], Mapping[str, bytes]],
) -> dict[str, Any] | None:
    """Tell the case that hides best.

    Parameters
    ----------
    scores, truths : mapping
        Of every case, by name.
    files_of : callable
        What the tool was given of a case.

    Returns
    -------
    dict or None
        ``case``, ``title``, ``says``, ``truth`` and ``overlays``; None where nothing was named right.
    """
    name = best_hidden(scores)
    if name is None:
        return None
    again = asked_again(files_of(name))
    hidden = scores[name]["concealment"]
    return {
        "case": name,
        "title": "The position looks perfect; the current gives it away",
        "says": (
            f"What acts in {name} changes the tracking error by {100 * abs(hidden['tracking']):.2g} % and the drive's "
            f"effort by {hidden['effort']:.3g} times its noise. The tool says: {again.says.replace('_', ' ')}"
        ),
        "truth": "; ".join(map(spelled, truths[name]["effects"])) + ".",
        "overlays": [thinned(overlay) for overlay in again.evidence["overlays"]],
    }


def best_hidden(scores: Mapping[str, Mapping[str, Any]]) -> str | None:
    """Choose among the cases whose one cause was named right, and nothing besides.

    Parameters
    ----------
    scores : mapping
        Of every case, by name.
    """
    hidden = {
        name: float(score["concealment"]["effort"]) / max(abs(float(score["concealment"]["tracking"])), PERFECT)
        for name, score in scores.items()
        if score.get("first_right") and not score["extra"] and len(score["kinds"]) == 1 and score["concealment"]
    }
    return max(sorted(hidden), key=lambda name: hidden[name], default=None)


def asked_again(files: Mapping[str, bytes]) -> Reconciliation:
    """Reconcile the recordings among `files` with their nominal model.

    Parameters
    ----------
    files : mapping of str to bytes
        What the tool was given.
    """
    with TemporaryDirectory(prefix="showcase-") as folder:
        for file, content in files.items():
            (Path(folder) / file).write_bytes(content)
        recordings = sorted(Path(folder).glob("*.parquet"))
        records = ingest.read(recordings).records
        return reconcile(records, load_models(Path(folder) / "nominal.toml").for_joint(records[0].joint))


def spelled(effect: Mapping[str, Any]) -> str:
    """Write what acted, with its numbers.

    Parameters
    ----------
    effect : mapping
        As the seal has it.

    Examples
    --------
    >>> spelled({"term": "coulomb_friction", "parameters": {"torque_nm": 2.1037}, "onset_s": None})
    'coulomb friction, torque_nm 2.1'
    """
    numbers = ", ".join(f"{name} {value:.3g}" for name, value in effect["parameters"].items())
    since = f", from {effect['onset_s']:.1f} s on" if effect["onset_s"] is not None else ""
    return f"{effect['term'].replace('_', ' ')}, {numbers}{since}"


def thinned(overlay: Mapping[str, Any]) -> dict[str, Any]:
    """Keep at most `MOST` samples of an overlay's curves, to six digits.

    Parameters
    ----------
    overlay : mapping
        ``name``, and arrays of one length.
    """
    stride = -(-np.size(overlay["t"]) // MOST)
    kept = {key: digits(values[::stride]) for key, values in overlay.items() if key != "name"}
    return {"name": overlay["name"], **kept}


def digits(values: Sequence[float]) -> list[float | None]:
    """Round to six digits, with None for what is no number.

    Parameters
    ----------
    values : sequence of float
        Samples.
    """
    return [float(f"{value:.6g}") if np.isfinite(value) else None for value in values]
