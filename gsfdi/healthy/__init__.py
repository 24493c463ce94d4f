"""The fault-free joint, found from fault-free recordings: a model file's plant where there is one, refined either way.

A real joint has friction, weight and cables that no linear model holds. What is learnt here is a description of
normality, not a diagnosis: terms share what they cannot tell apart, and a prior keeps each of them sensible.
"""

from gsfdi.healthy.learning import learn_nominal
from gsfdi.healthy.noise import noise_of
from gsfdi.healthy.samples import EXTRA, cut
from gsfdi.healthy.terms import BY_KEY

__all__ = ["BY_KEY", "EXTRA", "cut", "learn_nominal", "noise_of"]
