"""Nightly health verdicts for the joints of a space robot, and the physics that a simulation left out."""

__version__ = "0.1.0"
