"""Velocity lag: the speed in the log is older than the position beside it, as one that was filtered is."""

from gsfdi.motion import Param, PhysicsTerm, Vector


def age(m: Vector, p: Vector, s: Vector) -> float:
    """Give the lag itself."""
    return p[0]


TERM = PhysicsTerm(
    name="velocity_lag",
    component="sensor",
    meaning="the logged speed lags behind the logged position",
    maintenance="check the filter of the speed signal and when it is sampled",
    place="late_velocity_sensor",
    law=age,
    params=(
        Param(
            "lag_s",
            "s",
            "age of the speed beyond that of the position",
            start=0.002,
            low=0.0,
            high=1.0,
            typical=0.002,
            neutral=0.0,
            trials=lambda s: [share * s.period for share in (0.1, 0.5, 2.0)],
            plausible=lambda s, lag: (0.0, 10 * s.period),
        ),
    ),
    source="G. F. Franklin et al., Digital Control of Dynamic Systems (1998): a filter of time constant T lags by T",
    signature=("redundancy", "timing"),
    sets_in="rarely",
)
