"""Compile what both workers of the tests would compile each for itself; `make test` runs it while mypy checks types."""

from joints import MODEL, record

from gsfdi.proof.cases import Design, draw
from gsfdi.reconcile import reconcile

if __name__ == "__main__":
    draw(Design("null"), 5)
    reconcile([record("coulomb_friction=1.0")], MODEL)
