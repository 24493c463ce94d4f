"""When maintenance is due: a ledger of every batch's estimates, and degradation fitted over it.

`row` makes one batch's entry from its findings, ready for a store's ledger; `due` reads the entries of a joint. A row
holds, under ``shares``, for every fault of the library the share of the joint's capability that it takes and the
standard error of that; so one limit serves them all. Each history is fitted as ``c + b (t - t0)₊`` (ramp) and
``c + b (t - t0)²₊`` (gradual) by maximum likelihood: the batches' own errors, a scatter from night to night estimated
beside them, the onset unknown. The interval of the due date comes from the whole likelihood, not from its peak.
"""

from gsfdi.prognosis.ledger import SCHEMA, due, row
from gsfdi.prognosis.trend import Forecast, forecast

__all__ = ["SCHEMA", "Forecast", "due", "forecast", "row"]
