"""The seal: a promise, made before the first case is analysed, of what the answers to all cases are.

The truth is withheld: until the last answer is stored it exists in the memory of the parent process alone. What is
written beforehand is the SHA-256 of the very bytes that will be written once the seal is opened. A secret salt inside
those bytes keeps anyone from finding the truth by hashing guesses; since SHA-256 binds, nobody can change it either.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from gsfdi.atomic import write_text
from gsfdi.errors import UnusableInputError

SCHEMA = "gsfdi/seal/1"


@dataclass(frozen=True, slots=True)
class Sealed:
    """Truth of all cases under their neutral names, and the salt that hides it."""

    truths: Mapping[str, Any]
    salt: str

    @property
    def text(self) -> str:
        """The bytes that the seal promises, as text."""
        return spelled({"schema": "gsfdi/truth/1", "salt": self.salt, "cases": self.truths})

    @property
    def sha256(self) -> str:
        """What is printed beforehand."""
        return digest(self.text)


def spelled(value: object) -> str:
    """Spell a value the one way that is hashed."""
    return json.dumps(value, sort_keys=True, separators=(",", ":"), allow_nan=False)


def digest(text: str | bytes) -> str:
    """SHA-256 of text (as UTF-8) or bytes, in hexadecimal."""
    return hashlib.sha256(text.encode() if isinstance(text, str) else text).hexdigest()


def put(folder: Path, sealed: Sealed, inputs: Mapping[str, Mapping[str, str]]) -> str:
    """Store the promise: hash of the truth, and hashes of every file that the tool is given.

    Returns the hash of the truth. A folder that holds the same promise already is left alone; another one is refused.
    """
    path = folder / "seal.json"
    promise = {"schema": SCHEMA, "truth_sha256": sealed.sha256, "inputs": dict(inputs)}
    if path.exists():
        if promised(folder) != json.loads(json.dumps(promise)):
            raise sealed_otherwise(folder)
        return sealed.sha256
    write_text(path, json.dumps(promise, indent=1, sort_keys=True) + "\n")
    return sealed.sha256


def promised_inputs(folder: Path) -> Mapping[str, Any] | None:
    """Hashes of the files that a folder's seal promises for each case; None where there is no seal yet."""
    return promised(folder)["inputs"] if (folder / "seal.json").exists() else None


def sealed_otherwise(folder: Path) -> UnusableInputError:
    """Say that a folder promises other cases than those at hand."""
    path = folder / "seal.json"
    return UnusableInputError(path, "seals other cases than these", "choose another --out, or ask for the same")


def promised(folder: Path) -> dict[str, Any]:
    """Read the promise of a folder."""
    path = folder / "seal.json"
    mend = "give the folder that gsfdi prove wrote"
    try:
        promise = json.loads(path.read_text())
    except (OSError, ValueError) as error:
        raise UnusableInputError(path, f"is no seal ({error})", mend) from error
    if not isinstance(promise, dict) or not {"truth_sha256", "inputs"} <= promise.keys():
        raise UnusableInputError(path, "is no seal: it promises neither a truth nor inputs", mend)
    return promise


def opened(folder: Path) -> dict[str, Any]:
    """Read the truth of a folder, refusing any that is not what was promised."""
    promise, path = promised(folder), folder / "truth.json"
    try:
        text = path.read_bytes()
    except OSError as error:
        mend = "the seal is opened once the last answer is stored: let gsfdi prove end"
        raise UnusableInputError(path, "is not there", mend) from error
    if digest(text) != promise["truth_sha256"]:
        raise UnusableInputError(
            path, f"is not the truth that was sealed: its SHA-256 is {digest(text)}", "the seal is broken; prove again"
        )
    truths: dict[str, Any] = json.loads(text)["cases"]
    return truths


def bound(answers: Mapping[str, str]) -> str:
    """Give one hash over all stored answers, from case name to the hash of the answer's file."""
    return digest(spelled(dict(answers)))


def answer_hashes(folder: Path, names: Sequence[str]) -> dict[str, str]:
    """Hash every stored answer."""
    return {name: digest((folder / "answers" / f"{name}.json").read_bytes()) for name in names}
