"""Actuation delay: the torque comes later than the logged current."""

from gsfdi.motion import Param, PhysicsTerm, Vector


def delay(m: Vector, p: Vector, s: Vector) -> float:
    """Give the delay itself."""
    return p[0]


TERM = PhysicsTerm(
    name="actuation_delay",
    component="motor",
    meaning="torque follows the commanded current with a delay",
    maintenance="check the bus load and the drive's cycle time",
    place="delay",
    law=delay,
    params=(
        Param(
            "delay_s",
            "s",
            "time from commanded current to torque",
            start=0.005,
            low=0.0,
            high=1.0,
            typical=0.005,
            neutral=0.0,
            trials=lambda s: [share * s.period for share in (0.25, 1.0, 2.0)],
            plausible=lambda s, delay: (0.0, 10 * s.period),
        ),
    ),
    source="K. J. Åström and B. Wittenmark, Computer-Controlled Systems (1997): u(t) = u_k(t - d)",
    signature=("balance", "timing"),
)
