"""What is usual on a motion: the sizes in which effects are tried and judged."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Scales:
    """What is usual on this motion: the sizes in which effects are tried.

    Torque [N m] and effort are those of the drive (95th percentile), speed of the joint, reach half its range about
    `centre`, windup the spring's under that torque, `turns` motor radians per joint radian, `critical` the damping that
    would just keep the gearbox's own mode from ringing [N m s/rad], infinite for a rigid joint. It `warms` where the
    temperature changes, and `returns` where it moves either way.
    """

    torque: float
    effort: float
    speed: float
    reach: float
    centre: float
    windup: float
    inertia: float
    critical: float
    period: float
    seconds: float
    turns: float
    noise: float
    warms: bool
    returns: bool

    def of(self, unit: str) -> float:
        """Size of a plain effect for a number in `unit`."""
        return {
            "N m": self.torque,
            "N m s/rad": self.torque / self.speed,
            "N m s²/rad²": self.torque / self.speed**2,
            "N m/rad": self.torque / self.reach,
            "rad": self.windup,
            "rad/s": self.speed,
            "A": self.effort,
            "s": self.period,
            "1": 0.1,
            "1/rad²": self.windup**-2,
            "kg m²": self.inertia,
            "1/s": 1.0 / self.seconds,
        }[unit]
