"""The proof on concealed data: worlds that share no code with the simulator, sealed cases, scores, and a checker."""

from gsfdi.proof.checking import check
from gsfdi.proof.proving import prove

__all__ = ["check", "prove"]
