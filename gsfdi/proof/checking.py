"""Anyone's check of a proof: the seal holds, the inputs are what was sealed, the stored answers score as was said."""

import json
from pathlib import Path
from typing import Any

from gsfdi.errors import UnusableInputError
from gsfdi.proof.scoring import score
from gsfdi.proof.seal import answer_hashes, bound, opened, promised
from gsfdi.proof.summary import by_kind, calibration, confusion, rivals, summarise

SCHEMA = "gsfdi/proof/1"


def scored(folder: Path) -> dict[str, Any]:
    """Open the seal of a folder and score its stored answers.

    Cases come in the random order of their names; a proof that ran out of time has answered the first of them, and no
    answer may be missing among these. Returns what ``proof.json`` holds: the hashes, the figures, how far probabilities
    held, the rows by kind, the confusion matrix, every score.
    """
    truths, promise = opened(folder), promised(folder)
    answered = [name for name in sorted(truths) if (folder / "answers" / f"{name}.json").exists()]
    missing = set(sorted(truths)[: max(len(answered), 1)]) - set(answered)
    if missing:
        raise UnusableInputError(folder, f"lacks the answer to {min(missing)}", "let gsfdi prove end")
    replies = {name: json.loads((folder / "answers" / f"{name}.json").read_text()) for name in answered}
    scores = {name: score(truths[name], replies[name]) for name in answered}
    hashes = answer_hashes(folder, answered)
    rows = list(scores.values())
    return {
        "schema": SCHEMA,
        "seal": {"truth_sha256": promise["truth_sha256"], "answers_sha256": bound(hashes), "answers": hashes},
        "not_reached": len(truths) - len(answered),
        "figures": summarise(rows),
        "rivals": rivals(rows),
        "calibration": calibration(rows),
        "kinds": by_kind(rows),
        "confusion": confusion(rows),
        "scores": scores,
    }


def check(folder: Path) -> dict[str, Any]:
    """Check the seal of a stored proof, and score its answers again.

    Parameters
    ----------
    folder : Path
        What ``gsfdi prove`` wrote.

    Returns
    -------
    dict
        What ``proof.json`` holds, scored anew.

    Raises
    ------
    UnusableInputError
        If the truth is not the one that was sealed, an answer is not the one that was stored, an answer was got by
        reading what it may not, or the stored figures are not those that the answers give.
    """
    path = folder / "proof.json"
    try:
        stored = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise UnusableInputError(path, f"is no proof ({error})", "give the folder that gsfdi prove wrote") from error
    anew = json.loads(json.dumps(scored(folder)))
    for name, sha256 in anew["seal"]["answers"].items():
        if stored["seal"]["answers"].get(name) != sha256:
            answer = folder / "answers" / f"{name}.json"
            raise UnusableInputError(answer, "is not the answer that was scored", "the answer was tampered with")
    for name, one in anew["scores"].items():
        if one["trespassed"]:
            answer = folder / "answers" / f"{name}.json"
            raise UnusableInputError(answer, "was got by reading what the tool may not read", "its score is void")
    for part in ("seal", "not_reached", "figures", "rivals", "calibration", "kinds", "confusion", "scores"):
        if stored.get(part) != anew[part]:
            raise UnusableInputError(
                path, f"its {part} are not what the answers give", "trust the answers; prove again"
            )
    result: dict[str, Any] = stored
    return result
