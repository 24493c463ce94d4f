"""From fault-free records to the nominal joint behind them, step by step."""

from collections.abc import Sequence

from gsfdi.errors import BaselineError
from gsfdi.healthy.guess import first_guess, regressed
from gsfdi.healthy.noise import with_noise
from gsfdi.healthy.refinement import refined
from gsfdi.healthy.samples import cut, thinned
from gsfdi.healthy.terms import terms_shown
from gsfdi.healthy.tuning import tuned, weighted
from gsfdi.model import JointModel
from gsfdi.nominal import Nominal
from gsfdi.types import JointRecord


def learn_nominal(records: Sequence[JointRecord], model: JointModel | None) -> Nominal:
    """Find the nominal joint behind several fault-free records of it."""
    nominal = first_guess(records, model)
    parts = thinned([part for record in records for part in cut(record, nominal)])
    if not parts:
        raise BaselineError(
            records[0].joint, "no stretch of usable telemetry to learn from", "give longer fault-free batches"
        )
    nominal = with_noise(nominal, parts, model)
    if model is None:
        nominal = regressed(nominal, parts)
    nominal = tuned(nominal, parts)
    keys = terms_shown(nominal, parts)
    for _ in range(2):
        nominal = refined(nominal, parts, keys, model)
        nominal = tuned(nominal, parts)
    nominal = refined(nominal, parts, keys, model)
    return weighted(nominal, parts)
