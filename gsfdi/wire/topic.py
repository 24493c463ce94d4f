"""Messages of one topic to columns: take one apart, then read all that agree with it at once.

What of a message is no number must agree with the one that was taken apart; a message that differs becomes the next one
to be taken apart, so odd messages cost time but are never read by the wrong template.
"""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from gsfdi.mapping import Mapping
from gsfdi.types import Mask
from gsfdi.wire import Columns, Stamps
from gsfdi.wire.kernels import Ints
from gsfdi.wire.leaves import Leaf
from gsfdi.wire.rows import READ, SILENT, Messages, Rows
from gsfdi.wire.select import Choice, Clock, Pick, choose

MOST_BARREN = 32
"""A topic whose first templates hold no telemetry, this many of them, is given up."""
MOST_MESSAGE = 1 << 20
LONELY = 8
"""After so many templates of a block that fitted one message only, the others are taken one by one."""


class Reading(NamedTuple):
    """What a template says of some messages: which agree with it, and of these the stamps and picked numbers."""

    agree: Mask
    time_ns: Stamps
    picked: Iterable[tuple[Pick, np.ndarray]]


class Template(Protocol):
    """A message taken apart, by which others are read."""

    @property
    def choice(self) -> Choice:
        """What of it is read, and as what."""

    def read(self, messages: Messages, rows: Ints) -> Reading:
        """Read those of the rows that agree with it."""


class Form(Protocol):
    """How messages are encoded."""

    @property
    def most_kept(self) -> int:
        """Templates that are remembered for a topic."""

    @property
    def by_size(self) -> bool:
        """Whether only messages of one size can share a template."""

    def take_apart(self, data: bytes, choose: Callable[[Sequence[Leaf]], Choice]) -> Template | None:
        """Make a template of a message; None if it cannot be taken apart."""


class Topic:
    """Reads the messages of one topic.

    Parameters
    ----------
    name : str
    robot : str
        Whose joints they are, if no mapping says.
    form : Form
        How they are encoded.
    mappings : sequence of Mapping
        Those that name the topic.
    """

    def __init__(self, name: str, robot: str, form: Form, mappings: Sequence[Mapping]) -> None:
        self.name, self.robot, self.form, self.mappings = name, robot, form, mappings
        self.templates: dict[int, list[Template]] = {}
        self.kept = self.barren = 0
        self.fruitful = False
        self.backlog: Counter[str] = Counter()

    @property
    def given_up(self) -> bool:
        """Whether nothing in the topic looks like telemetry."""
        return not self.fruitful and self.barren >= MOST_BARREN

    def columns(self, messages: Messages) -> Iterator[Columns]:
        """Read messages, in the order given.

        Parameters
        ----------
        messages : Messages
        """
        out = Rows(messages)
        if self.form.by_size:
            for size in np.unique(messages.sizes).tolist():
                self._group(messages, int(size), np.flatnonzero(messages.sizes == size), out)
        else:
            self._group(messages, 0, np.arange(len(messages.starts)), out)
        return out.columns(self.name, self.fruitful, self.backlog)

    def _group(self, messages: Messages, group: int, rows: Ints, out: Rows) -> None:
        """Read messages that may share templates; what cannot be read stays undecodable."""
        known = self.templates.setdefault(group, [])
        for template in known:
            rows = self._apply(template, messages, rows, out)
        lonely = 0
        while len(rows) and not self.given_up:
            learnt = self._learn(messages, int(rows[0]))
            if learnt is None:
                rows = rows[1:]
                continue
            alone = lonely > LONELY
            left = self._apply(learnt, messages, rows[:1] if alone else rows, out)
            fitted = len(rows) - len(left)
            if alone or not fitted:  # a number may turn out to be none when it is read
                rows = rows[1:]
                continue
            lonely += fitted == 1
            if fitted > 1 and self.kept < self.form.most_kept:
                known.append(learnt)
                self.kept += 1
            rows = left

    def _learn(self, messages: Messages, row: int) -> Template | None:
        """Take a message apart; None where that is not possible."""
        start, size = int(messages.starts[row]), int(messages.sizes[row])
        learnt = None
        if size <= MOST_MESSAGE:
            learnt = self.form.take_apart(messages.data[start : start + size].tobytes(), self._choose)
        told = learnt is not None and bool(learnt.choice.picks)
        self.fruitful |= told
        self.barren += not told
        return learnt

    def _choose(self, leaves: Sequence[Leaf]) -> Choice:
        return choose(leaves, self.name, self.robot, self.mappings)

    def _apply(self, template: Template, messages: Messages, rows: Ints, out: Rows) -> Ints:
        """Read the rows that agree with the template; give back the others."""
        found, choice = template.read(messages, rows), template.choice
        own = rows[found.agree]
        if len(own):
            out.state[own] = READ if choice.picks else SILENT
            if choice.picks:
                out.time_ns[own] = found.time_ns
            out.name(choice.joints, own)
            self.backlog["ragged"] += len(own) if choice.ragged else 0
            for pick, read in found.picked:
                out.fill(pick, own, read)
        others: Ints = rows[~found.agree]
        return others


def stamps_of(clock: Clock, read: Callable[[str], np.ndarray], messages: Messages, own: Ints) -> Stamps:
    """Stamps of messages by the clock that was chosen; `read` gives the numbers at a path.

    Parameters
    ----------
    clock : Clock
    read : callable
    messages : Messages
    own : (n,) int array
        Which of them.
    """
    if clock.seconds:
        return ticks_to_ns(read(clock.seconds), 1_000_000_000) + ticks_to_ns(read(clock.nanos), 1)
    if clock.ticks:
        return ticks_to_ns(read(clock.ticks), clock.tick_ns) + clock.epoch_ns
    return messages.published_ns[own] if clock.published else messages.log_ns[own]


def ticks_to_ns(ticks: np.ndarray, tick_ns: int) -> Stamps:
    """Ticks of a clock, whole or not, in nanoseconds; -1 s for what is no time.

    Parameters
    ----------
    ticks : (n,) array
    tick_ns : int
    """
    if ticks.dtype.kind in "iu":
        fits = np.abs(ticks.astype(np.float64)) < 2.0**62 / tick_ns
        return np.where(fits, ticks, 0).astype(np.int64) * tick_ns
    known = np.isfinite(ticks) & (np.abs(np.nan_to_num(ticks)) < 2.0**62 / tick_ns)
    usable = np.where(known, ticks, 0.0).astype(np.float64)
    return np.floor(usable).astype(np.int64) * tick_ns + np.round((usable % 1.0) * tick_ns).astype(np.int64)
