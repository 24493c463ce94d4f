"""Simulates a joint: replays of a recording, and recordings of the simulator's own.

The interface others build on::

    drive = drive_of(record, model)               # what the recording commands, measures and starts from
    trace = replay(model, drive)                  # closed loop on the recorded setpoint
    trace = replay(model, drive, "open_loop")     # on the recorded effort
    trace = replay(model, drive, "predict", gain=K)             # observer; trace.innovation is (n, 2)
    trace = replay(model, drive, "open_loop", restarts=[0, 500, 1000])   # multiple shooting; states= sets its states
    traces = replay_many(models, drive, ...)      # the same for many models in one compiled loop
    with at_once(4): ...                          # replays of many models by four threads
    record = simulate_record(model, faults=[fault_of("cogging=2@30", "rotary")], seed=1)   # with sensor noise and bus

A state is ``[Ω, Ω̇, ε, ε̇, integral part of the controller]``, a gain ``K`` (4, 2): state against the innovations of
position and of motor speed (joint speed of a rigid joint). A trace holds what noise-free sensors would show. What the
recording holds is in ``drive.signals``, and ``drive_from(signals, model)`` drives a replay with signals of any origin.
"""

from gsfdi.drive import Drive, drive_from, drive_of
from gsfdi.fault import fault_of
from gsfdi.simulate.recording import simulate_record
from gsfdi.simulate.replaying import Mode, Trace, at_once, innovations_of, replay, replay_many
from gsfdi.starting import Signals, Start, initial_state

__all__ = [
    "Drive",
    "Mode",
    "Signals",
    "Start",
    "Trace",
    "at_once",
    "drive_from",
    "drive_of",
    "fault_of",
    "initial_state",
    "innovations_of",
    "replay",
    "replay_many",
    "simulate_record",
]
