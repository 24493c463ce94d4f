"""Learn what the fault-free joints of a robot do, and give it as plain numbers that a store can keep.

``learn(records, models)`` takes the records of several fault-free batches, sorts them by joint and learns each joint's
nominal model (`gsfdi.healthy`) and what every detector of the shelf makes of it. ``Baseline.to_dict`` gives nested
dictionaries of str, float, int, lists and float64 arrays; ``Baseline.from_dict`` takes them back.
"""

from gsfdi.baseline.gathering import Gathering, detectors
from gsfdi.baseline.kept import Baseline, JointBaseline
from gsfdi.baseline.learning import learn, learn_joint, part_of

__all__ = ["Baseline", "Gathering", "JointBaseline", "detectors", "learn", "learn_joint", "part_of"]
