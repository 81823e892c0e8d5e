"""One unit of work, and its result. No files, no ranks."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from operator import attrgetter
from typing import Any

from numpy.typing import NDArray

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.solver.outcome import Outcome
from nanoslip.solver.slab import Slab
from nanoslip.study.manifest.parameters import Value, in_words
from nanoslip.study.origin import Origins

Label = tuple[tuple[str, ...], tuple[Value | None, ...]]
"""What a task is labelled by, names and values: parameters, the ensemble's member, the drive. What is None is left out."""


@dataclass(frozen=True, slots=True)
class Task:
    """One computation, named by its content: equal keys mean equal results."""

    key: str
    """Hash of the kind and of all that decides the result, in the solver's units (20 hexadecimal digits)."""
    kind: str
    """One of nanoslip.study.plan.tasks.KINDS."""
    slab: Slab
    case: Case | None = None
    """The physics point; None for a compliance."""
    drive: Drive | None = None
    """How the pin is pulled; drive tasks only."""
    events: tuple[int, ...] = ()
    """Events after which the contact is looked at; states tasks only."""
    subsurface: bool = False
    """Whether the inside of the slab is looked at too; states tasks only."""
    scalars_only: bool = False
    """Whether the result's arrays are left out."""
    fitted: bool = True
    """Whether the closed form is fitted to the motion; drive tasks only."""
    intermediate: bool = False
    """Whether the result is wanted by other tasks only, not by the campaign."""
    ensemble: Ensemble = ALONE
    """How many starts of the case are computed."""
    shared: bool = field(default=False, compare=False)
    """Whether other tasks read the result."""
    needs: tuple[str, ...] = ()
    """Keys of the tasks whose results this one reads."""
    cost: float = 0.0
    """Estimated seconds on one core."""
    memory: float = field(default=0.0, compare=False)
    """Estimated bytes of arrays while it runs, beside the compliance that it maps and the program's own."""
    disk: float = field(default=0.0, compare=False)
    """Estimated bytes of its result."""
    limit: float = field(default=math.inf, compare=False)
    """Seconds after which it is taken to hang."""
    names: tuple[str, ...] = field(default=(), compare=False)
    """Of its label, and `values`."""
    values: tuple[Value | None, ...] = field(default=(), compare=False)

    def planned(self, cost: float, memory: float, disk: float, limit: float, label: Label) -> "Task":
        """The task with the fields that a plan adds."""
        make: Any = Task
        planned: Task = make(*_CONTENT(self), cost, memory, disk, limit, *label)
        return planned

    @property
    def label(self) -> str:
        """For humans, in the words of a manifest."""
        pairs = zip(self.names, self.values, strict=True)
        words = [f"{name}={_short(value)}" for name, value in pairs if value is not None]
        return in_words(" ".join((self.kind, *words)))


_CONTENT = attrgetter(*itertools.takewhile(lambda name: name != "cost", (item.name for item in fields(Task))))
"""All that is not the plan's; faster than `replace`, for millions of tasks."""


def _short(value: Value) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)


@dataclass(frozen=True, slots=True, eq=False)
class TaskResult:
    """The result of a task, refusals included; all numbers in the solver's units."""

    key: str
    kind: str
    outcome: Outcome
    scalars: Mapping[str, Sequence[float | int]] = field(default_factory=dict)
    """Of each member one, by the name that its kind's parts give them (see nanoslip.study.plan.kinds.kind)."""
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    """By name likewise: of the first member, or of all of them one behind the other (`Kind.all_members`)."""
    members: tuple[Outcome, ...] = ()
    """How each member ended; empty where all ended as the task did."""
    origins: Origins = ()
    """The software that computed it and what it was computed from; empty where nobody knows."""


Inputs = Mapping[str, TaskResult]
"""Key of a task -> its result, of all that another one needs."""
