"""From findings to a verdict: which fault, how sure, how bad, since when, and what else it could be.

``assess(record, joint_baseline, ...)`` takes a record, or successive pieces of a long one, and gives a `Verdict` whose
``findings`` carry what a page draws; `Judging` takes the pieces one by one as they come. A finding's ``evidence``, by
``Finding.detector``:

``signals``
    ``t, setpoint, position, effort`` (and ``velocity``, ``tracking``) : arrays of at most 1500 points [s, SI];
    ``features`` : list of str; ``scores`` : array, deviations of each from the baseline; ``threshold`` : float;
    ``feature`` : str, the one that stands out most.
``parity``
    ``t, residual`` : arrays, running statistic of the long window; ``threshold`` : float; ``t3, residual3,
    threshold3`` : the same for the paper's three samples.
``innovations``
    ``t, residual`` : arrays, running lean towards the most likely fault in deviations; ``threshold`` : float;
    ``names`` : list of str; ``z, size, error, onset, ramp, gain, robust`` : arrays, one value per direction.
``smi``
    ``t, angles`` : arrays, largest principal angle to the baseline [rad] by block; ``threshold`` : float [rad];
    ``markov`` : array, deviations of the Markov parameters by block; ``markov_threshold`` : float.
``diagnosis``
    ``names, probabilities, sizes, errors, units, cosines`` : lists over the candidate faults, most probable first;
    ``severity`` : float, share of the joint's usual drive that the fault takes.

Every finding has ``onset_s`` where it saw one. Levels: a fault whose test alarms is a warning; it is distress, then
critical, when the share of the joint's capability that it takes reaches the limits in `Limits`.
"""

from gsfdi.diagnosis.judging import Judging, assess
from gsfdi.diagnosis.limits import Limits
from gsfdi.diagnosis.refusal import unjudged

__all__ = ["Judging", "Limits", "assess", "unjudged"]
