"""Where a fault becomes serious, and how often a verdict may be wrong."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Limits:
    """Where a fault becomes serious, and how often the whole battery may be wrong.

    Parameters
    ----------
    distress, critical : float
        Share of the joint's capability that a fault takes: the change of a ratio, else the effect in terms of torque.
    false_alarms_per_joint_year : float
        Promised rate of verdicts above ``normal`` on fault-free telemetry.
    batches_per_year : float
        How often a joint is judged.
    stale_after_s : float
        Age beyond which telemetry is called stale, when the caller says what time it is.
    payload_free : bool
        Whether the output inertia may change without being a fault (a payload was taken).
    """

    distress: float = 0.10
    critical: float = 0.30
    false_alarms_per_joint_year: float = 0.1
    batches_per_year: float = 365.0
    stale_after_s: float = 3.0 * 86400.0
    payload_free: bool = False

    @property
    def per_batch(self) -> float:
        """False-alarm rate of one verdict."""
        return self.false_alarms_per_joint_year / self.batches_per_year
