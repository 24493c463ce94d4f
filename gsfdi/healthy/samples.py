"""Which samples a joint is learnt from and judged by."""

from collections.abc import Sequence

from gsfdi.nominal import Nominal
from gsfdi.stretches import Stretch, stretches
from gsfdi.types import JointRecord

EXTRA = ("setpoint", "temperature")
"""Channels carried along where every batch has them."""


def cut(record: JointRecord, nominal: Nominal, extra: Sequence[str] = ()) -> list[Stretch]:
    """Stretches of a record on which the nominal joint's observer can run."""
    return list(stretches(record, nominal.channels + tuple(extra), nominal.step))


def thinned(parts: list[Stretch], most: int = 120_000) -> list[Stretch]:
    """At most about `most` samples, taken evenly over the stretches, so that learning takes a bounded time."""
    total = sum(len(part.trusted) for part in parts)
    if total <= most:
        return parts
    kept, share, owed = [], most / total, 0.0
    for part in parts:
        owed += share * len(part.trusted)
        take = int(min(owed, len(part.trusted)))
        if take >= 200:
            kept.append(
                part._replace(values={k: v[:take] for k, v in part.values.items()}, trusted=part.trusted[:take])
            )
            owed -= take
    return kept
