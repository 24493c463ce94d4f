"""What physics sees of a joint in motion, and what a term of physics has to say of itself.

A term is one scalar law ``law(m, p, s) -> float``: `m` holds the motion quantities below at their fixed places, `p` the
term's parameters in the order it declares them, `s` its `STATES` states (NaN until the law first runs). Every consumer,
the compiled replay and a regression alike, calls that one law; what the returned number means follows from the place
where the term acts (`Place`). Torques are at the output axis and **resist**: a positive law slows positive motion.

With Ω the motor angle reflected to the output, ε the wind-up and θ = Ω + ε the joint angle, a flexible joint obeys

    N² Im Ω̈ = N Kt i + τ_s - f_motor          Ison θ̈ + β θ̇ + τ_s + f_output = 0

where τ_s is the spring's torque, c ε unless a term changes it; a rigid joint ``Ison q̈ + β q̇ = N Kt i - f``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal, Protocol

from gsfdi.channels import Axis
from gsfdi.scales import Scales
from gsfdi.types import Array, Component

# Places in the motion vector. ANGLE and SPEED belong to the side on which the term sits. Compiled laws have these
# numbers frozen in: after a change here, remove numba's caches (`__pycache__`).
TIME = 0  # since the start of the recording [s]
STEP = 1  # length of the integration step around this instant [s]; 0 where there is none
ANGLE = 2  # [rad]
SPEED = 3  # [rad/s]
DIRECTION = 4  # of the motion that a dry friction would resist, +1 or -1
MOTOR_TURN = 5  # motor shaft angle N Ω [rad]; a linear drive's ratio N is in rad/m
JOINT_ANGLE = 6  # [rad]
WINDUP = 7  # ε, after the terms that change the deflection [rad]
WINDUP_RATE = 8  # [rad/s]
LOAD = 9  # torque that the gearbox passes on [N m]; the drive's torque in a rigid joint
CURRENT = 10  # drive effort that acts now [A]
TEMPERATURE = 11  # [degC]; 20 where the recording has none
STIFFNESS = 12  # nominal stiffness of the spring [N m/rad]
VALUE = 13  # what a map acts on: a deflection, a current or a measured value
ONSET = 14  # when the term set in [s]
LEVER = 15  # spring torque on the motor per torque on the output; a `windup` map that follows the motor sets it
GEAR = 16  # gear ratio N
ANGLE_JUMPED = 17  # what an observer has added to ANGLE [rad]: no motion, for a law that remembers where it was
WINDUP_JUMPED = 18  # what it has added to ε [rad]
BEGUN = 19  # stretch, as a share of the full, with which a bristle begins: what came before has left it there
SWING = 20  # how far an appendage is behind the joint as it begins [rad]: what came before has left it swinging
SWING_RATE = 21  # [rad/s]
EARLY = 22  # by how much what waves give acts before its mean over the step, in their unit (see `gsfdi.wave`)
QUANTITIES = 23

STATES = 5 + 2 * 32  # what a bristle needs to remember 32 reversals
FEW = 2  # of them are enough for most laws, which leave the rest NaN
REFERENCE_TEMPERATURE = 20.0

Place = Literal[
    "torque_constant",  # law: factor on the motor's torque
    "motor_inertia",  # law: factor on the motor's inertia
    "output_inertia",  # law: factor on the output's inertia
    "stiffness",  # law: factor on the spring's stiffness
    "current",  # map: commanded current -> current that flows, and is measured
    "delay",  # law: time from the commanded current to its torque [s]
    "torque",  # law: resisting torque on the term's side
    "dry",  # law: level of dry friction in DIRECTION on the term's side; sticks below it
    "windup",  # map: difference of joint and motor angle -> deflection of the spring
    "spring",  # law: torque that the spring passes on beyond c times the deflection
    "position_sensor",  # map: joint angle -> measured
    "velocity_sensor",  # map: motor speed (joint speed of a rigid joint) -> measured
    "current_sensor",  # map: drive effort -> measured
    "latency",  # law: age of position and velocity when they are stamped [s]
    "late_velocity_sensor",  # law: age of the velocity alone, beyond that [s]
]


class Vector(Protocol):
    """Numbers by place: an array in Python, a pointer in the compiled replay."""

    def __getitem__(self, place: int, /) -> float:
        """Read the number at `place`."""

    def __setitem__(self, place: int, value: float, /) -> None:
        """Write the number at `place`."""


Law = Callable[[Vector, Vector, Vector], float]


@dataclass(frozen=True, slots=True)
class Param:
    """A parameter of a term: contract name, unit, what it may be, and what is usual.

    Parameters
    ----------
    name, unit, meaning : str
        As in the contract's table.
    start : float
        Where a search begins, and what stands where a model file or ``--fault`` leaves the parameter out.
    low, high : float
        Bounds of the possible.
    typical : float
        Size of an effect worth naming: the scale of a prior around `neutral`.
    neutral : float or None
        The value at which the term has no effect; None where no single value of this parameter does that.
    linear : bool
        Whether the law is proportional to the parameter, so that a regression finds it directly.
    kind : {'plain', 'angle', 'arm', 'follower', 'choice', 'detail'}
        How it acts beside the number that sizes the term. An ``angle`` counts on past `low` and `high`, turn after
        turn; one without `trials` is a phase, which sine and cosine span. An ``arm`` makes the law size · (x - arm) or
        size · (1 + arm x), which two trials span. A ``follower`` grows with the size; its trials belong to a full one.
        A ``choice``, 0 to `high`, is between laws that go by one name: no fit turns it. A ``detail`` refines a law, and
        is left out, which makes it `start`, unless it earns its place once the term is there.
    size : callable or None
        On a motion, value to try of the number that sizes the term, the first that has a `neutral` and no `trials`;
        without it, 5 % off a `neutral` of 1, or at most a tenth of what is usual in its unit.
    trials : callable or None
        On a motion, values to try of a number that does not enter in proportion; none where the term cannot show.
    plausible : callable or None
        On a motion and near a value, bounds within which the number is still what its name says; without it, what
        suits an order or an angle, else those of the possible.
    step : callable or None
        On a motion, size of a change that matters to a fit; without it, what suits an order or an angle, else the
        distance from `neutral`.
    """

    name: str
    unit: str
    meaning: str
    start: float
    low: float
    high: float
    typical: float
    neutral: float | None = None
    linear: bool = False
    kind: Literal["plain", "angle", "arm", "follower", "choice", "detail"] = "plain"
    size: Callable[[Scales], float] | None = None
    trials: Callable[[Scales], Sequence[float]] | None = None
    plausible: Callable[[Scales, float], tuple[float, float]] | None = None
    step: Callable[[Scales], float] | None = None


@dataclass(frozen=True, slots=True)
class PhysicsTerm:
    """One piece of physics beyond the linear joint.

    Parameters
    ----------
    name, component : str
        The contract's id, and the part of the joint to which it belongs.
    meaning : str
        One sentence on what happens in the joint.
    maintenance : str
        What it asks of the people who look after the joint.
    place : Place
        Where the law acts, and so what its number means.
    law : callable
        ``law(m, p, s) -> float``.
    params : tuple of Param
        The first is the one that ``--fault ID=VALUE`` sets.
    source : str
        Where the law comes from: the equation itself, and its number where it is the paper's.
    signature : tuple of str
        Where it shows: ``balance`` (torque balance of motor plus link), ``windup``, ``output``, ``redundancy``
        (between sensors), ``proportional`` (scales with the predicted torque), ``timing``.
    sides : tuple of str
        Where the term can sit, the usual side first; empty where there is no choice.
    structures : tuple of str
        Joints that can have it.
    axes : tuple of str
        Axes in whose motion it is looked for.
    sided : bool
        Whether a dry friction is greater in one direction than in the other, and so its law reads `DIRECTION`; it is
        looked for only where the joint moves both ways.
    dissipative : bool
        Whether it can only take energy out, for parameters within their bounds.
    memory : bool
        Whether the law keeps states.
    stiffness, damping : callable or None
        Largest slope of the law against angle [N m/rad] and speed [N m s/rad], from the parameters: the replay's
        step must resolve what they make.
    wave : str
        Parameter that counts periods per motor revolution, which the step must resolve too.
    sets_in : {'readily', 'rarely', 'never'}
        How it may set in from one moment to the next: readily, as damage, contact or a failing sensor does; rarely, as
        what lies in the design, teeth, magnets and cables; never, as what says itself where or when it acts.
    several : bool
        Whether a joint may have more than one of it.
    beside : tuple of str
        Terms that must be in a model before this one may join, because alone it would stand for a mixture of them.
    """

    name: str
    component: Component
    meaning: str
    maintenance: str
    place: Place
    law: Law
    params: tuple[Param, ...]
    source: str
    signature: tuple[str, ...]
    sides: tuple[Literal["motor", "output"], ...] = ()
    structures: tuple[Literal["flexible", "rigid"], ...] = ("flexible", "rigid")
    axes: tuple[Axis, ...] = ("rotary", "linear")
    sided: bool = False
    dissipative: bool = False
    memory: bool = False
    stiffness: Callable[[Array], float] | None = None
    damping: Callable[[Array], float] | None = None
    wave: str = ""
    sets_in: Literal["readily", "rarely", "never"] = "readily"
    several: bool = False
    beside: tuple[str, ...] = ()

    @property
    def numbers(self) -> tuple[Param, ...]:
        """Parameters that the term always has: all but a choice of law and the details that must earn their place."""
        return tuple(param for param in self.params if param.kind not in ("choice", "detail"))

    @property
    def order(self) -> Param | None:
        """Number that counts periods per revolution, which makes the term a wave.

        Revolutions are the motor's, or the joint's where the term acts on what is measured of the joint's angle.
        """
        return next((param for param in self.params if param.unit == "1/rev"), None)

    @property
    def frequency(self) -> Param | None:
        """Natural frequency, which makes the term a resonance."""
        return next((param for param in self.params if param.unit == "Hz"), None)

    def param(self, name: str) -> Param:
        """Find the parameter called `name`, in its rotary or its linear spelling."""
        return next(param for param in self.params if name in (param.name, linear_name(param.name)))


def linear_name(name: str) -> str:
    """Spell a rotary parameter or key as a linear drive does.

    Examples
    --------
    >>> linear_name("coefficient_nms_rad"), linear_name("torque_nm"), linear_name("inertia_kg_m2")
    ('coefficient_ns_m', 'torque_n', 'mass_kg')
    """
    if name.startswith("phase_"):
        return name
    if "inertia" in name:
        return name.replace("inertia", "mass").replace("_m2", "")
    return "_".join(_LINEAR.get(word, word) for word in name.split("_"))


_LINEAR = {"nm": "n", "nms": "ns", "nms2": "ns2", "rad": "m", "rad2": "m2"}
