"""What a kind of task is, and how the solver's values become the scalars and arrays of a result, and back.

A result holds the numbers of the kind's `parts`: dataclasses of the solver whose fields declare what they are
(solver.quantity). What a part declares is in results, dataset and tables without another word.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import lru_cache
from operator import attrgetter
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from solver.case import Case
from solver.drive import Drive
from solver.elasticity.compliance import Compliance, SurfaceCompliance, normal_compliance
from solver.outcome import COMPLETED, Outcome
from solver.quantity import Quantity, quantities
from solver.slab import Slab
from study.manifest.manifest import Manifest
from study.plan.task import Inputs, Task, TaskResult

Value = TypeVar("Value")


class Part(NamedTuple):
    """A dataclass of which a kind's results hold the numbers."""

    type: type
    prefix: str = ""
    """What its fields' names get in front in results and, where they have no name of their own, in datasets."""
    whole: bool = False
    """Whether numbers that are no quantities are held too, as another task reads them."""
    wanted: Callable[[Manifest], bool] = lambda _: True
    """Whether a campaign asks for it; the value of a part that it does not ask for is None."""


@dataclass(frozen=True, slots=True)
class Ragged:
    """Columns of a kind's results in a dataset: one behind the other over `sample`, a run of it for each `instance`."""

    instance: str
    """The group that they are in, too. Several kinds may add to one group, where they have the same columns."""
    sample: str
    count: str
    """Variable over the instances: the length of each run."""
    wanted: Callable[[Manifest], bool]


class Wanted(NamedTuple):
    """A task of a case."""

    task: Task
    drive: str = ""
    """Label of its drive, where it has one."""
    free: bool = False
    """Whether it only reads off another task's result."""


@dataclass(frozen=True, slots=True)
class Computed:
    """The result of a task before it is stored: the values of its kind's parts, in their order, and its outcome."""

    values: tuple[object, ...] = ()
    outcome: Outcome = COMPLETED
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """Those that are in no part."""


class Estimate(NamedTuple):
    """What a task costs, roughly: seconds to a factor of three, bytes to a factor of two or three."""

    seconds: float
    """On one core of an ordinary machine."""
    memory: float
    """Bytes of arrays while it runs, beside the compliance that it maps and the program's own."""
    disk: float
    """Bytes of its result."""


@lru_cache(maxsize=256)  # the tasks of a campaign share the number itself
def disk_of(scalars: float, arrays: float = 0.0) -> float:
    """Bytes of a result with so many scalars and so many numbers in arrays."""
    return _ARCHIVE + _SCALAR * scalars + 8.0 * arrays


_ARCHIVE = 1000.0  # of a result: its ending, its origin, and the archive's own
_SCALAR = 30.0  # as text, with its name


@dataclass(frozen=True, slots=True)
class Kind:
    """One kind of task. Its stage is its place in study.plan.tasks.KINDS."""

    name: str
    needed: Callable[[Manifest], bool]
    """Whether a campaign needs such tasks at all."""
    tasks: Callable[[Case, Manifest], tuple[Wanted, ...]]
    """Those of one case, needed ones first; the last one of a drive is the case's own."""
    run: Callable[[Task, Inputs], Computed]
    """Raises SolverError where the physics refuses."""
    estimate: Callable[[Task], Estimate]
    """What a task costs, from its case alone."""
    parts: tuple[Part, ...] = ()
    """In the order of a dataset's variables."""
    ragged: tuple[Ragged, ...] = ()
    takes_failed: bool = False
    """Whether it can be run with what ended badly."""


@lru_cache(maxsize=256)
def declared(kind: Kind, along: str = "") -> Mapping[str, Quantity]:
    """Name of each scalar of a kind's results that is a quantity -> its declaration; or of each array along a dimension."""
    found = [each for part in kind.parts for each in quantities(part.type, part.prefix).items()]
    return {key: quantity for key, quantity in found if quantity.along == along}


def left_out(kind: Kind, manifest: Manifest) -> frozenset[str]:
    """Names of the scalars and arrays of those parts of a kind that a campaign does not ask for."""
    parts = (part for part in kind.parts if not part.wanted(manifest))
    return frozenset(name for part in parts for name in quantities(part.type, part.prefix))


def numbers(kind: Kind, values: tuple[object, ...]) -> tuple[dict[str, float | int], dict[str, NDArray[Any]]]:
    """Scalars and arrays of the values of a kind's parts."""
    scalars: dict[str, float | int] = {}
    arrays: dict[str, NDArray[Any]] = {}
    for part, value in zip(
        kind.parts, values, strict=False
    ):  # a result that was not asked for all lacks the last parts
        if value is None:
            continue
        held = _held(part)
        for key, words, number in zip(held.keys, held.words, held.values(value), strict=True):
            if isinstance(number, np.ndarray):
                arrays[key] = number
            elif not isinstance(number, Outcome):
                scalars[key] = _coded(number, words) if words else number
    return scalars, arrays


class _Held(NamedTuple):
    """Of each number of a part that results hold: its name in them, and the words that it stands for."""

    keys: tuple[str, ...]
    words: tuple[tuple[str, ...], ...]
    values: Callable[[object], tuple[Any, ...]]
    """All of them, of a value of the part."""


@lru_cache(maxsize=64)
def _held(part: Part) -> _Held:
    known = quantities(part.type, part.prefix)
    named = {f"{part.prefix}{item.name}": item.name for item in fields(part.type)}
    held = {key: name for key, name in named.items() if part.whole or key in known}
    words = tuple(known[key].words if key in known else () for key in held)
    names = tuple(held.values())
    return _Held(tuple(held), words, attrgetter(*names) if len(names) > 1 else lambda value: (getattr(value, *names),))


def _coded(value: Any, words: tuple[str, ...]) -> float | int:
    """Of a text its position, NaN of none."""
    return float("nan") if value is None else words.index(value)


def whole_again(kind: type[Value], result: TaskResult, prefix: str = "") -> Value:
    """The solver's value that `numbers` took apart: of a whole part with this prefix."""
    held: dict[str, Any] = {**result.scalars, **result.arrays, f"{prefix}outcome": result.outcome}
    make: Any = kind
    return make(**{item.name: held[f"{prefix}{item.name}"] for item in fields(make)})  # type: ignore[no-any-return]


def case_of(task: Task) -> Case:
    """The physics point of a task that has one, as all but a compliance do."""
    assert task.case is not None
    return task.case


def drive_of(task: Task) -> Drive:
    """How the pin is pulled in a drive task."""
    assert task.drive is not None
    return task.drive


def compliance_of(task: Task, inputs: Inputs) -> Compliance:
    """The compliance that a task needs before anything else; where it needs none, what the slab's surface says by itself."""
    if not task.needs:
        return normal_compliance(task.slab)
    return _compliance_in(inputs[task.needs[0]], task.slab)


@lru_cache(maxsize=4)  # tasks that follow each other get the same one: the solver keeps what it computes of it
def _compliance_in(result: TaskResult, slab: Slab) -> SurfaceCompliance:
    return SurfaceCompliance(result.arrays["matrix"], slab)


def scalars_only_mark(scalars_only: bool) -> tuple[str, ...]:
    """What a key gets where the result's arrays are left out."""
    return ("scalars",) if scalars_only else ()
