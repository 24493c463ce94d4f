"""Torque constant that fades with time: the fault of the paper's headline example."""

from gsfdi.motion import ONSET, TIME, Param, PhysicsTerm, Vector


def factor(m: Vector, p: Vector, s: Vector) -> float:
    """Give max(0, 1 + rate (t - onset)), from the later of `onset_s` and the onset of the term."""
    return max(0.0, 1.0 + p[0] * max(0.0, m[TIME] - max(p[1], m[ONSET])))


TERM = PhysicsTerm(
    name="torque_constant_drift",
    component="motor",
    meaning="the motor's torque constant drifts steadily",
    maintenance="plan the replacement of the motor before its torque margin is spent",
    place="torque_constant",
    law=factor,
    params=(
        Param(
            "rate_per_s",
            "1/s",
            "relative change of the torque constant per second",
            start=-0.01,
            low=-1.0,
            high=1.0,
            typical=0.005,
            neutral=0.0,
            linear=True,
            plausible=lambda s, rate: (-0.1, 0.1),
        ),
        Param(
            "onset_s",
            "s",
            "when the drift begins, from the start of the recording",
            start=0.0,
            low=0.0,
            high=1e9,
            typical=10.0,
            trials=lambda s: [share * s.seconds for share in (0.0, 0.2, 0.4, 0.6, 0.8)],
            plausible=lambda s, onset: (0.0, 0.98 * s.seconds),
            step=lambda s: 0.05 * s.seconds,
        ),
    ),
    source="the paper's section 5: Kt of its eq. 5-1 falls by 1 %/s from 7.5 s",
    signature=("balance", "proportional"),
    sets_in="never",
)
