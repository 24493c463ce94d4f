"""The answer for one joint: what is told, in the published form, and the arrays behind it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from gsfdi.model import JointModel

Outcome = Literal["no_mismatch", "explained", "partly_explained", "unexplained", "not_enough_data"]


@dataclass(frozen=True, slots=True)
class Reconciliation:
    """What reconciling one joint came to.

    Parameters
    ----------
    joint : str
    verdict : Outcome
    mismatch : mapping
        ``detected``, ``p_value``, ``effect`` and, in torque, ``before_nm`` and ``after_nm``.
    location : mapping
        ``component``, ``signals``, ``where``, ``when``, ``bands_hz``.
    omitted_physics : tuple of mapping
        Named terms, most probable first.
    indistinguishable : tuple of tuple of str
        Terms that the data cannot tell apart.
    parameters : mapping
        Numbers of the linear model as the data have them, over their nominal values.
    fit : mapping
        Held-out figures before, after and of noise alone.
    says : str
        One sentence for a person.
    updated_model : JointModel or None
    evidence : mapping
        Arrays for the page: ``overlays``, ``profiles``, ``maps``, ``ranking``, ``experiments`` (see
        `gsfdi.reports.reconcile_page`).
    together : tuple of mapping
        Quotients and products of numbers that are known far better than these (see `gsfdi.reconcile.together`).
    """

    joint: str
    verdict: Outcome
    mismatch: Mapping[str, Any]
    location: Mapping[str, Any]
    omitted_physics: tuple[Mapping[str, Any], ...]
    indistinguishable: tuple[tuple[str, ...], ...]
    parameters: Mapping[str, Any]
    fit: Mapping[str, Any]
    says: str
    updated_model: JointModel | None = None
    evidence: Mapping[str, Any] = field(default_factory=dict)
    together: tuple[Mapping[str, Any], ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Give the joint's object in ``reconcile.json``."""
        return {
            "joint": self.joint,
            "verdict": self.verdict,
            "mismatch": dict(self.mismatch),
            "location": dict(self.location),
            "omitted_physics": [dict(entry) for entry in self.omitted_physics],
            "indistinguishable": [list(group) for group in self.indistinguishable],
            "parameters": dict(self.parameters),
            "together": [dict(pair) for pair in self.together],
            "fit": dict(self.fit),
            "says": self.says,
        }
