"""Outcomes of computations: an `Outcome` with advice if physics or numerics fail, an exception if the input is wrong.

A case that cannot be computed is data, not a crash. Exceptions are for input without meaning (`InvalidInput`) and matrices
without an inverse (`SingularOperator`). Both name the offending value and the requirement.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Final, Self


class Ending(StrEnum):
    """Reason why a computation stopped. `COMPLETED` is the only success of a computation that was begun."""

    meaning: str

    def __new__(cls, value: str, meaning: str = "") -> Self:
        """Word for files and tables, and its meaning in a sentence."""
        self = str.__new__(cls, value)
        self._value_, self.meaning = value, meaning
        return self

    COMPLETED = "completed", "a requested limit of the case (events, displacement, duration) was reached"
    INVALID = "invalid", "the input means nothing: a value out of range or a combination that excludes itself"
    SINGULAR_OPERATOR = "singular_operator", "a matrix that must be invertible is not (to working precision)"
    CONTACT_NOT_CONVERGED = (
        "contact_not_converged",
        "no contact set satisfied constraints I and III within the iteration limit",
    )
    SLIP_UNBOUNDED = (
        "slip_unbounded",
        "a node's shear does not fall when it slips: Coulomb friction has no unique answer there",
    )
    CASCADE_LIMIT = "cascade_limit", "one event needed more slips than the limit allows"
    OVERSHOT = "overshot", "a step as small as allowed moved the pin further than the friction law lets it"
    ENERGY_CREATED = "energy_created", "events of the record created energy, which friction cannot"
    CONTACT_LOST = "contact_lost", "no node was left that could carry the load (the pin left the slab)"
    EDGE_REACHED = "edge_reached", "the sharp edge of a flat punch came upon a node that was not under it"
    STEEP_PIN = (
        "steep_pin",
        "the pin is too steep where it touches: what lies along and across the slab is no longer shear and pressure",
    )
    ROUNDING = (
        "rounding",
        "rounding decides the result, as the numbers of this case differ by too many orders of magnitude",
    )
    NO_EVENT = "no_event", "no further event exists: the contact sticks however far the pin moves"
    NO_PLATEAU = "no_plateau", "the friction record never became steady"
    NO_SLIP = "no_slip", "the driven pin never slipped macroscopically, so there is no static friction to measure"
    STEP_LIMIT = "step_limit", "an integrator needed more steps than the limit allows"
    UNSTABLE_STEP = "unstable_step", "the requested time step is beyond the integrator's stability limit"
    REVERSED = "reversed", "the driven pin slipped back although it was not to (`reverse_motion` of its drive)"
    NEEDS_FAILED = "needs_failed", "an input of this computation failed"
    NOT_NEEDED = "not_needed", "no computation needed: earlier results suffice. Nothing failed, and there are no values"
    OUT_OF_MEMORY = "out_of_memory", "the machine ran out of memory: another machine may compute the case"
    TIMED_OUT = (
        "timed_out",
        "the computation did not end in the time that it was given: it hangs, or is much more work than estimated",
    )
    CRASHED = (
        "crashed",
        "the computation raised what it never should, or its process died: a defect of the program, not of the case",
    )


LONGEST_MESSAGE = 1000
"""Letters of a message."""


def printable(text: str, most: int) -> str:
    """A text of several lines without control characters and lone surrogates, which are escaped, and of at most `most` letters.

    A longer one is cut in its middle.
    """
    shown = (letter if letter.isprintable() or letter == "\n" else ascii(letter)[1:-1] for letter in _cut(text, most))
    # Once more, as an escape is longer than what it stands for.
    return _cut("".join(shown), most)


def _cut(text: str, most: int) -> str:
    half = (most - len(_CUT)) // 2
    return text if len(text) <= most else text[: most - half - len(_CUT)] + _CUT + text[-half:]


_CUT = " ... "


@dataclass(frozen=True, slots=True)
class Outcome:
    """Ending of a computation, with advice.

    `message` is one printable line of at most LONGEST_MESSAGE letters: the offending value, then the advice. It is empty after
    success; a completed result with missing numbers has one, too.
    """

    ending: Ending
    message: str = ""
    longer: bool = False
    """True if a longer drive helps: which key says how long is the reader's to name."""
    cause: str = ""
    """Name of the fact that the message words with its values; empty if its words are always the same."""

    def __post_init__(self) -> None:
        message = self.message
        if not message.isprintable() or len(message) > LONGEST_MESSAGE:
            object.__setattr__(self, "message", printable(" ".join(message.split()), LONGEST_MESSAGE))

    @property
    def ok(self) -> bool:
        """True if the computation completed."""
        return self.ending is Ending.COMPLETED

    @property
    def usable(self) -> bool:
        """True if all computed numbers are valid, though some may be missing: the outcome names them."""
        return self.ending in _USABLE

    @property
    def kind(self) -> str:
        """Name that outcomes share if their messages differ in values alone."""
        return self.cause or self.message

    def adding(self, more: "Outcome") -> "Outcome":
        """Outcome with a message more; the ending stays."""
        both = [outcome for outcome in (self, more) if outcome.message]
        cause = "; ".join(outcome.kind for outcome in both) if any(outcome.cause for outcome in both) else ""
        return Outcome(self.ending, "; ".join(outcome.message for outcome in both), self.longer or more.longer, cause)

    def naming(self, key: str) -> "Outcome":
        """Outcome whose message advises to raise the key that gives the duration of the drive, if a longer drive
        helps."""
        return self if not self.longer else replace(self, message=f"{self.message}; raise {key}", longer=False)


_USABLE = frozenset({Ending.COMPLETED, Ending.NO_PLATEAU, Ending.NO_SLIP})
UNDONE = {Ending.CRASHED: "crashed", Ending.TIMED_OUT: "took too long", Ending.OUT_OF_MEMORY: "ran out of memory"}
"""Endings without information about the case and without a result, in words."""
COMPLETED = Outcome(Ending.COMPLETED)
INDEFINITE: Final = "indefinite_compliance"
ROUNDED: Final = "rounded_compliance"
"""Causes of endings that a compliance is to blame for: its scheme, or rounding, against which an aspect_ratio nearer 1 helps."""

SHOWN = 60
"""Characters of a value that a message shows."""


class NanoslipError(Exception):
    """Base of everything that nanoslip raises on purpose."""


class SolverError(NanoslipError):
    """Base of the solver's own exceptions; carries an outcome."""

    ending = Ending.INVALID
    cause = ""
    """Name of the fact, as in `Outcome`."""

    @property
    def outcome(self) -> Outcome:
        """Equivalent outcome, as a value."""
        return Outcome(self.ending, str(self), cause=self.cause)


def quote_value(value: object) -> str:
    """A value as messages show it: cut to fit a line, whatever it is."""
    try:
        text = str(value).lower() if isinstance(value, bool) else repr(value)
    except (ValueError, RecursionError):  # Python writes no number of more than 4300 digits, and nothing nested deeply
        return "(too long to show)"
    return text if len(text) <= SHOWN else text[: SHOWN - 3] + "..."


ABSENT: Final = ...
"""Value of an argument in a message that shows none."""
Need = str | Callable[[str], str]
"""Allowed values: a text, or a function from the key's name to it, as bounds are."""


class InvalidInput(SolverError, ValueError):
    """An argument is out of range: its key, its value, and the allowed values."""

    def __init__(
        self, key: str, value: object = ABSENT, need: Need = "", beside: Mapping[str, object] | None = None
    ) -> None:
        """beside: other arguments, with which the value is not allowed."""
        super().__init__(key, value, need, beside)  # all arguments, so that other processes get it whole
        self.key, self.value, self.beside, self._need = key, value, beside or {}, need
        self.cause = " ".join((key, *self.beside))

    @property
    def need(self) -> str:
        """Allowed values, in words."""
        return self._need if isinstance(self._need, str) else self._need(self.key)

    def rename_keys(self, names: Mapping[str, str]) -> "InvalidInput":
        """Error with other names for some keys."""
        beside = {names.get(key, key): value for key, value in self.beside.items()}
        return InvalidInput(names.get(self.key, self.key), self.value, self._need, beside)

    def __str__(self) -> str:
        values = {self.key: self.value, **self.beside}
        entries = (key if value is ABSENT else f"{key} = {quote_value(value)}" for key, value in values.items())
        return ": needs ".join(filter(None, (" with ".join(entries), self.need)))


class SingularOperator(SolverError):
    """An operator that must be invertible is not; the message names it and the likely cause."""

    ending = Ending.SINGULAR_OPERATOR

    def __init__(self, message: str, cause: str = "") -> None:
        """cause: of a message with values, as in `Outcome`."""
        super().__init__(message)
        self.cause = cause


class TooFarApart(SolverError):
    """Numbers of magnitudes so different that double precision cannot combine them; the message names them."""

    ending = Ending.ROUNDING
