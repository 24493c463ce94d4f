"""Quantisation: the position sensor reads in steps."""

from gsfdi.motion import VALUE, Param, PhysicsTerm, Vector


def measured(m: Vector, p: Vector, s: Vector) -> float:
    """Give y rounded to the nearest step."""
    return round(m[VALUE] / p[0]) * p[0] if p[0] > 0.0 else m[VALUE]


TERM = PhysicsTerm(
    name="quantisation",
    component="sensor",
    meaning="the position sensor's resolution is coarser than it should be",
    maintenance="check the position sensor for lost bits",
    place="position_sensor",
    law=measured,
    params=(
        Param(
            "step_rad",
            "rad",
            "size of a step",
            start=1e-4,
            low=0.0,
            high=1.0,
            typical=1e-4,
            neutral=0.0,
            trials=lambda s: (),  # it shows in the values themselves, not in the mechanics
        ),
    ),
    source="B. Widrow and I. Kollár, Quantization Noise (2008): y = q round(x / q)",
    signature=("redundancy",),
    sets_in="never",
)
