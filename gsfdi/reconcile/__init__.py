"""Where simulation and recording differ, which physics was left out, and the fit once it is modelled."""

from gsfdi.reconcile.reconciliation import Reconciliation
from gsfdi.reconcile.run import reconcile

__all__ = ["Reconciliation", "reconcile"]
