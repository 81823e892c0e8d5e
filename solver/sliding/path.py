"""A contact along a path of pin displacement and load: each leg is a friction record that counts its direction as
forward; and numbers of loops."""

import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, replace
from typing import Any, Final

import numpy as np

from nanoslip.solver.arrays import Vector
from nanoslip.solver.case import MOST_EVENTS, RECORD, Case
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.state import Direction
from nanoslip.solver.contact.state import ContactState
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.load_path import Loops, PathLine, Point, Turns
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome
from nanoslip.solver.parameter import as_field, quantities, require
from nanoslip.solver.progress import part_of_progress
from nanoslip.solver.sliding.plateau import teeth
from nanoslip.solver.sliding.record import FrictionRecord
from nanoslip.solver.sliding.slide import run_way
from nanoslip.solver.sliding.validity import DOUBTFUL, contact_flags, encode_flags, record_flags
from nanoslip.solver.sliding.way import Run, Way
from nanoslip.solver.view import Curve, Labelled, Picture, Viewed, describe_outcome, label_numbers


def _as_turn(name: str) -> Any:
    """A field of a leg that `Turns` declares for all legs."""
    return as_field(replace(quantities(Turns)[name], along=""))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False, repr=False)
class Leg(FrictionRecord):
    """One leg of a path as a record: displacement counts from its turn, forces are positive against its direction.

    `normal_load` is that at its end. Where the pin rests, displacement is 0, stiffness NaN, and forces are positive as in the leg
    before.
    """

    direction: int = _as_turn("direction")
    turn: float = _as_turn("begin")
    """δ_p where it begins, in L_x."""
    first_load: float = _as_turn("first_load")
    """Load where it begins, in G·L_x·L_y."""
    case_load: float
    """W of the case, in G·L_x·L_y."""
    load: Vector | None
    """(e,) load after each event; None if it does not change."""
    load_work: float = _as_turn("load_work")
    """Work of the load, in G·L_x²·L_y."""
    lost: float = _as_turn("lost")
    """Energy lost, also after the last event."""

    def _factors(self) -> dict[str, float]:
        return {"normal_load": 1.0 / self.case_load}

    def curve(self) -> tuple[Vector, Vector]:
        """δ_p and friction force with its sign, before and after each event and at both ends, in L_x and G·L_x·L_y."""
        leg_teeth = teeth(self)
        force = np.column_stack((leg_teeth.start, leg_teeth.end)).ravel()
        displacement = np.repeat(leg_teeth.edges, 2)[1:-1]
        return self.turn + self.direction * displacement, self.direction * force


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Path(Viewed):
    """A contact along a path: its legs up to the last that is whole, and the contact where that ends."""

    legs: tuple[Leg, ...]
    start: ContactState
    end: ContactState
    normal_load: float
    """W of the case."""
    stiffness: float
    """dF/dδ_p with all nodes stuck before the path, in G·L_y."""
    presliding_length: float
    """μ_i·W/K, in L_x."""
    cycles: int
    """Whole cycles, of two legs each, with which it ends."""
    validity_flags: int
    """Flags of all legs (see `Flag`)."""
    outcome: Outcome

    def curve(self) -> tuple[Vector, Vector]:
        """δ_p and friction force along all legs."""
        line = path_line(self)
        return line.displacement, line.force

    def _facts(self) -> Iterator[str]:
        yield f"{len(self.legs)} legs"
        yield f"{sum(len(leg.displacement) for leg in self.legs)} events"
        yield describe_outcome(self.outcome)

    def _label_values(self) -> Iterator[Labelled]:
        return itertools.chain(
            label_numbers(loops_of(self)), label_numbers(leg_numbers(self)), label_numbers(path_line(self))
        )

    def _factors(self) -> dict[str, float]:
        return {"normal_load": 1.0 / self.normal_load}

    def _picture(self) -> Picture:
        """F/W over displacement, as loops."""
        x, force = self.curve()
        return Picture("pin displacement δ_p/L_x", "friction force F/W", (Curve(x, force / self.normal_load),))


ELASTIC: Final = 1e-6
"""Loss of a cycle over the elastic energy at a turn, ½·F·amplitude, below which it counts as elastic: shaken down it is 1e-10,
otherwise above 1e-2 (amplitude 0.3 presliding lengths, full drop, n_x = 129)."""


def follow(case: Case, compliance: Compliance, seen: Callable[[ContactState], None] = lambda _: None) -> Path:
    """The contact of `case` along its path, from initial contact on. Failures of the physics are the path's outcome.

    seen: callback, called with the contact at every turn, the first of which is initial contact.
    """
    start = initial_contact(case, compliance)
    legs: list[Leg] = []
    alone = replace(
        case, path=RECORD, max_events=MOST_EVENTS, max_presliding=None, max_displacement=None, max_spacings=None
    )
    # A run that ends where it starts: it has the stiffness.
    before = run_way(alone, compliance, start, Way(case.normal_load, until=start.displacement)).record
    end, outcome, flags = start, before.outcome, encode_flags(contact_flags(case, start))
    points = [*case.path.points(case.normal_load, before.presliding_length)] if outcome.ok else []
    if outcome.ok and case.path.cyclic:
        outcome = _rounding_outcome(*points[-2:])
    if outcome.ok:
        seen(start)
    else:
        points = []
    for leg, state, raised in _follow_legs(alone, compliance, start, points):
        outcome = state.outcome
        flags |= raised
        if not outcome.ok:
            break
        legs.append(leg)
        seen(state)
        end = state
    cycles = case.path.cycles if case.path.cyclic and outcome.ok else 0
    constants = (case.normal_load, before.initial_stiffness, before.presliding_length)
    return Path(tuple(legs), start, end, *constants, cycles, flags & DOUBTFUL, outcome)


def _rounding_outcome(one: Point, other: Point) -> Outcome:
    """`COMPLETED`, or `ROUNDING` where cycles between two points drown in the rounding of the pin's position."""
    stroke, rounding = abs(other[0] - one[0]), float(np.spacing(max(abs(one[0]), abs(other[0]))))
    if rounding <= ELASTIC * stroke:  # or loops would close, and shake down, by rounding
        return COMPLETED
    message = "the pin's position is rounded by more than a millionth of the stroke: raise amplitude or stroke"
    return Outcome(Ending.ROUNDING, message)


def _follow_legs(
    case: Case, compliance: Compliance, start: ContactState, points: Sequence[Point]
) -> Iterator[tuple[Leg, ContactState, int]]:
    """Each leg, the contact where it ends, and the validity flags raised on its way."""
    state, load, ahead = start, case.normal_load, 1
    for number, point in enumerate(points):
        way = straight_way(state, load, ahead, point)
        if way is None:
            continue
        # Tolerances are shares of the load: of the larger one along a leg.
        scaled = replace(case, normal_load=max(load, point[1]))
        with part_of_progress(number / len(points), (number + 1) / len(points)):
            run = run_way(scaled, compliance, state, way)
        flags = encode_flags(record_flags(scaled, start, run.record, run.end))
        yield _leg(run, state, way, point[1], case.normal_load), run.end, flags
        state, load, ahead = run.end, point[1], way.direction.ahead


def straight_way(state: ContactState, load: float, ahead: int, point: Point) -> Way | None:
    """The straight way to a point from a contact under this load; None if it is there. ahead: as the pin last moved."""
    moved, raised = point[0] - state.displacement, point[1] - load
    # The step counts the pin's way, and the load changes in proportion; where the pin rests it counts the
    # load.
    if moved:
        ahead = 1 if moved > 0.0 else -1
        return Way(load, Direction(float(ahead), raised / abs(moved), ahead), point[0])
    return Way(load, Direction(0.0, math.copysign(1.0, raised), ahead), point[1]) if raised else None


def _leg(run: Run, start: ContactState, way: Way, load: float, case_load: float) -> Leg:
    """A run as a leg that ends at this load."""
    record, (pin_rate, load_rate, ahead) = run.record, way.direction
    columns = {item.name: getattr(record, item.name) for item in fields(record)}
    # A leg is a record in its own direction: forces count against its motion, displacements from its turn.
    for name in _SIGNED:
        columns[name] = ahead * columns[name]
    for name in _PLACED:
        columns[name] = ahead * (columns[name] - start.displacement)
    # While the pin rests and the load changes, no displacement is there to divide a force by.
    if not pin_rate:
        columns["stiffness"] = np.full_like(record.stiffness, math.nan)
    for column in columns.values():
        if isinstance(column, np.ndarray):
            column.setflags(write=False)
    return Leg(
        **{**columns, "normal_load": load, "initial_slips": 0},
        direction=ahead,
        turn=start.displacement,
        first_load=way.load,
        case_load=case_load,
        load=run.load if load_rate else None,
        load_work=run.load_work,
        lost=run.lost,
    )


_SIGNED: Final = ("force_before", "force_after", "initial_force", "final_force")
_PLACED: Final = ("displacement", "final_displacement")


_NO_LOOPS: Final = Loops(**dict.fromkeys((item.name for item in fields(Loops)), math.nan))


def loops_of(path: Path) -> Loops:
    """The numbers of the cycles with which a path ends."""
    require("path", path, isinstance(path, Path), "a Path, as friction_path(case) returns it")
    if not path.cycles:
        return replace(_NO_LOOPS, path_stiffness=path.stiffness)
    legs = path.legs[-2 * path.cycles :]
    later = legs[path.cycles // 2 * 2 :]
    loss = sum(leg.lost for leg in later) / (len(later) / 2)
    # From one turn to the next, in the direction of each leg.
    risen = float(np.mean([leg.final_force - leg.initial_force for leg in later]))
    gone = float(np.mean([leg.final_displacement for leg in later]))
    # Elastic energy at a turn, ½ · risen/2 · gone/2: none where every node drops to 0 there. Equivalent damping is the loss over
    # 4π times this.
    elastic = risen * gone / 8.0
    return Loops(
        cycle_amplitude=gone / 2.0 / path.presliding_length,
        cycle_stroke=gone,
        loss_per_cycle=loss,
        first_loss=legs[0].lost + legs[1].lost,
        turn_friction=risen / 2.0 / legs[-1].normal_load,
        secant_stiffness=risen / gone,
        closure=max(map(_apart, legs[-4:-2], legs[-2:])) / legs[-1].normal_load if path.cycles > 1 else math.nan,
        shaken_down=float(legs[-1].lost + legs[-2].lost < ELASTIC * elastic),
        equivalent_damping=2.0 * loss / (math.pi * risen * gone) if elastic else math.nan,
        path_stiffness=path.stiffness,
    )


def _apart(leg: Leg, then: Leg) -> float:
    """The largest difference between the forces of two legs at one displacement."""
    one, other = teeth(leg), teeth(then)
    until = min(one.edges[-1], other.edges[-1])
    # Forces jump at events: they are compared at each edge and just before it.
    places = np.concatenate((one.edges, other.edges))
    places = np.concatenate((places, np.nextafter(places, 0.0)))
    places = np.unique(np.minimum(places, until))
    apart = one.force(places) - other.force(places)
    return float(np.abs(apart).max())


def leg_numbers(path: Path) -> Turns:
    """The numbers of all legs of a path."""
    legs = path.legs
    return Turns(
        direction=np.array([leg.direction for leg in legs], np.int8),
        begin=np.array([leg.turn for leg in legs]),
        end=np.array([leg.turn + leg.direction * leg.final_displacement for leg in legs]),
        first_load=np.array([leg.first_load for leg in legs]),
        last_load=np.array([leg.normal_load for leg in legs]),
        first_force=np.array([leg.direction * leg.initial_force for leg in legs]),
        last_force=np.array([leg.direction * leg.final_force for leg in legs]),
        lost=np.array([leg.lost for leg in legs]),
        load_work=np.array([leg.load_work for leg in legs]),
        events=np.array([len(leg.displacement) for leg in legs], np.int64),
        slips=np.array([leg.slips.sum() for leg in legs], np.int64),
    )


def path_line(path: Path) -> PathLine:
    """Friction force and load over displacement along all legs of a path."""
    curves = [leg.curve() for leg in path.legs] or [(np.empty(0), np.empty(0))]
    loads = [_loads(leg) for leg in path.legs] or [np.empty(0)]
    return PathLine(
        displacement=np.concatenate([x for x, _ in curves]),
        force=np.concatenate([force for _, force in curves]),
        load=np.concatenate(loads),
        leg=np.repeat(np.arange(len(loads), dtype=np.int32), list(map(len, loads))),
    )


def _loads(leg: Leg) -> Vector:
    """Loads at the points of `Leg.curve`."""
    at_events = np.full(len(leg.displacement), leg.normal_load) if leg.load is None else leg.load
    return np.concatenate(([leg.first_load], np.repeat(at_events, 2), [leg.normal_load]))
