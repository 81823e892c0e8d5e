"""The sum of the friction records of all contacts of an interface (nanoslip.solver.sliding.interface), and its record.

Forces are summed at PIECES equal distances, exactly, so memory does not grow with the number of contacts. Between them the
sum may be higher by at most `unseen_force`, from each contact's highest force there.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from functools import reduce
from typing import Any, Final

import numpy as np
import scipy

from nanoslip.solver.arrays import Floats
from nanoslip.solver.case import Case, Effects, SlipRule
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import Compliance
from nanoslip.solver.ensemble import ALONE, Ensemble, fewest_members
from nanoslip.solver.outcome import COMPLETED, Ending, Outcome, SolverError
from nanoslip.solver.progress import part_of_progress
from nanoslip.solver.sliding.interface import PIECES, Portion, batches, chances, compressions, interface_contact
from nanoslip.solver.sliding.plateau import teeth
from nanoslip.solver.sliding.record import FrictionRecord, farthest
from nanoslip.solver.sliding.slide import slide, slide_to_state
from nanoslip.solver.sliding.statistics import EventStatistics, event_statistics
from nanoslip.solver.sliding.validity import Validity, record_validity

_ENDINGS: Final = tuple(Ending)
_LARGEST: Final = ("end", "presliding_length", "end_nodes")
"""Numbers of a sum of portions that are the largest of them."""
_ADDED: Final = (
    *("force", "contact_size", "highest", "slips", "releases", "touches", "extent", "dissipated"),
    *("contacts", "load", "stiffness", "half_width", "initial_slips"),
    *("events", "slip_events", "release_events", "touch_events", "fallen", "lost"),
)
"""Numbers that are added. A number in neither list is an error, until its author has decided."""
_COUNTED: Final = ("slips", "releases", "touches", "extent")


def shares(case: Case, compliance: Compliance) -> Floats:
    """(N,) Load of each contact over their mean."""
    drawn, seen = chances(case), np.array(case.interface.measured_loads)
    # A chance from 0 to 1 picks each of the measured loads as often as any other.
    if len(seen):
        loads = seen[(drawn * len(seen)).astype(np.int64)]
    elif case.interface.loads == "equal":
        return np.ones(len(drawn))
    else:
        compressed = compressions(drawn)
        loads = compressed if case.interface.loads == "exponential" else _relative_loads(case, compliance, compressed)
    return np.asarray(loads / loads.mean())


def _relative_loads(case: Case, compliance: Compliance, compressed: Floats) -> Floats:
    """Forces (N,) over their mean, on contacts pressed to multiples `compressed` of a common depth; the depth follows
    from the mean load."""
    first = interface_contact(case, 0)
    alone = replace(first, effects=Effects(friction=False), slip_rule=SlipRule())
    # Load over depth is close to a power law: it is straight between logarithms of doubled loads.
    # Even the most compressed of 10⁶ contacts, ln 10⁶ = 14 times the mean, bears about 14^1.5 = 52 times
    # as much as one at the mean depth (a ball's load grows as depth^1.5): less than 2⁷.
    loads = case.normal_load * 2.0 ** np.arange(-20.0, 8.0)
    loads = loads[loads <= 1.0]
    states = [initial_contact(replace(alone, normal_load=load), compliance) for load in loads.tolist()]
    approach = np.array([state.approach for state in states])
    is_good = np.array([state.outcome.ok for state in states]) & (approach > 0.0)
    reaches_twice = is_good.any() and loads[is_good][-1] >= 2.0 * case.normal_load
    if not is_good[loads <= 2.0 * case.normal_load].all() or not reaches_twice:
        unknown = Outcome(Ending.INVALID, 'loads = "heights": no normal contact about this load; use "exponential"')
        refused = (state.outcome for state in states if not state.outcome.ok)
        raise _make_error(next(refused, unknown))
    depth = np.log(approach[is_good])
    over_mean_load = np.log(loads[is_good] / case.normal_load)

    def load_share(logarithm: float) -> Floats:
        depths = logarithm + np.log(compressed)
        return np.asarray(np.exp(np.interp(depths, depth, over_mean_load)))

    def missing(logarithm: float) -> float:
        return float(load_share(logarithm).mean()) - 1.0

    lowest, highest = depth[0] - 1.0, depth[-1] + 1.0
    return load_share(scipy.optimize.brentq(missing, lowest, highest))


def portion(case: Case, compliance: Compliance, first: int, beyond: int, places: Ensemble = ALONE) -> Portion:
    """The sum over contacts `first` to `beyond` - 1. A contact without a record is lost, and counted: never raises."""
    joined = _empty()
    try:
        loads = shares(case, compliance)
        # All records end together, where the heaviest contact's does: it takes the longest way to slide.
        heaviest = int(loads.argmax())
        end = _end(interface_contact(case, heaviest, loads[heaviest], places), compliance)
    except SolverError as error:
        return _count_lost(joined, error.outcome, beyond - first)
    for number in range(first, beyond):
        try:
            contact = interface_contact(case, number, loads[number], places)
            with part_of_progress((number - first) / (beyond - first), (number + 1 - first) / (beyond - first)):
                joined = _add_portions(joined, _alone(contact, compliance, end))
        except SolverError as error:
            joined = _count_lost(joined, error.outcome, 1)
    return joined


def _end(case: Case, compliance: Compliance) -> float:
    """δ_p at which the records of all contacts end: the limit of this one."""
    # One event is enough to know the stiffness, in which limits in presliding lengths are given.
    begun = slide(replace(case, max_events=1), compliance)
    end = farthest(case, begun.presliding_length)
    if not begun.outcome.ok:
        raise _make_error(begun.outcome)
    if not 0.0 < end < math.inf:
        raise _make_error(
            Outcome(
                Ending.INVALID,
                f"contacts of one slider end at one displacement, not at {end:g}: give limits.spacings",
                cause="ends_apart",
            )
        )
    return end


def _make_error(outcome: Outcome) -> SolverError:
    error = SolverError(outcome.message)
    error.ending, error.cause = outcome.ending, outcome.cause
    return error


def _alone(case: Case, compliance: Compliance, end: float) -> Portion:
    """The portion of a single contact. Raises SolverError if it has no record up to `end`."""
    case = replace(case, max_presliding=None, max_spacings=None, max_displacement=end)
    start = initial_contact(case, compliance)
    record, last = slide_to_state(case, compliance, start)
    if not record.outcome.ok:
        raise _make_error(record.outcome)
    if not record.final_displacement >= end * (1.0 - 1e-12):  # rounding of a sum of steps
        reached = f"{len(record.displacement)} events reach {record.final_displacement / end:.2g} of the slider's way"
        raise _make_error(Outcome(Ending.INVALID, f"{reached}: raise limits.events", cause="few_events"))
    record_teeth, edges = teeth(record), np.linspace(0.0, end, PIECES + 1)
    # A record may end a rounding before the common end.
    force = record_teeth.force(np.minimum(edges, record_teeth.edges[-1]))
    force[-1] = record.final_force
    # The piece of the way in which each event lies; an event at the very end belongs to the last.
    piece = edges.searchsorted(record.displacement, side="right") - 1
    piece = np.clip(piece, 0, PIECES - 1)
    # Between events force is straight: it is highest at an end of a piece or at an event within.
    highest = np.maximum(force[:-1], force[1:])
    np.maximum.at(highest, piece, np.maximum(record.force_before, record.force_after))
    sizes = np.insert(record.contact_size, 0, record.initial_contact_size)
    valid, counted = record_validity(case, start, record, last), event_statistics(record)
    added: dict[str, Any] = {}
    for name in (*_COUNTED, "dissipated"):
        column = getattr(record, name)
        added[name] = np.bincount(piece, column, PIECES).astype(column.dtype)
    return Portion(
        force=force,
        contact_size=sizes[record.displacement.searchsorted(edges, side="right")],
        highest=highest,
        **added,
        contacts=1,
        load=record.normal_load,
        end=end,
        stiffness=record.initial_stiffness,
        presliding_length=record.presliding_length,
        half_width=valid.contact_half_width,
        validity_flags=valid.validity_flags,
        end_nodes=record.end_nodes,
        initial_slips=record.initial_slips,
        events=counted.events,
        slip_events=counted.slips,
        release_events=counted.releases,
        touch_events=counted.touches,
        fallen=counted.mean_drop * counted.events * record.normal_load if counted.events else 0.0,
        lost=0,
        ending=0,
    )


def _empty() -> Portion:
    made: dict[str, Any] = {item.name: 0 for item in fields(Portion)}
    made["force"] = np.zeros(PIECES + 1)
    made["contact_size"] = np.zeros(PIECES + 1, np.int32)
    made["slips"] = np.zeros(PIECES, np.int64)
    for name in ("highest", "dissipated"):
        made[name] = np.zeros(PIECES)
    for name in ("releases", "touches", "extent"):
        made[name] = np.zeros(PIECES, np.int32)
    return Portion(**made | {"outcome": COMPLETED})


def _count_lost(portion: Portion, outcome: Outcome, lost: int) -> Portion:
    """A portion with some contacts lost. Its own outcome is completed; lost contacts are counted and reported once."""
    first = not portion.lost
    ending = _ENDINGS.index(outcome.ending) if first else portion.ending
    reported = replace(outcome if first else portion.outcome, ending=Ending.COMPLETED)
    return replace(portion, lost=portion.lost + lost, ending=ending, outcome=reported)


def _add_portions(one: Portion, other: Portion) -> Portion:
    """Add two portions: numbers of both together, the largest of others, the first end that lost contacts."""
    values: dict[str, Any] = {}
    for name in _ADDED:
        values[name] = getattr(one, name) + getattr(other, name)
    for name in _LARGEST:
        values[name] = max(getattr(one, name), getattr(other, name))
    first = one if one.lost else other
    flags = one.validity_flags | other.validity_flags
    return Portion(**values, validity_flags=flags, ending=first.ending, outcome=first.outcome)


@dataclass(frozen=True, slots=True)
class Slider:
    """An interface as a single record: the sum of its contacts' records."""

    validity: Validity
    statistics: EventStatistics
    record: FrictionRecord
    bound: float
    """Upper bound of its force, in G·L_x·L_y."""
    lost: int


def slider(case: Case, portions: Iterable[Portion]) -> Slider:
    """The sum of all portions, in their order. Its events are pieces in which the contacts have theirs; none has a node.

    Raises SolverError if fewer than half of the contacts have a record.
    """
    total = reduce(_add_portions, portions)
    if total.contacts < fewest_members(case.interface.contacts):
        raise _make_error(replace(total.outcome, ending=_ENDINGS[total.ending]))
    # Contacts with a record carry the load of those without, too.
    share = case.total_load / total.load
    edges = np.linspace(0.0, total.end, PIECES + 1)
    force = total.force * share
    columns = {
        "displacement": edges[1:],
        "force_before": force[1:],
        "force_after": force[1:],
        "stiffness": np.append(np.diff(force)[1:], 0.0) * (PIECES / total.end),
        "kind": np.zeros(PIECES, np.int8),
        "node": np.full(PIECES, -1, np.int32),
        "contact_size": total.contact_size[1:].copy(),
        **{name: getattr(total, name).copy() for name in _COUNTED},
        "dissipated": total.dissipated * share,
        "node_x": np.empty(0),
        "node_slips": np.empty(0, np.int64),
    }
    for column in columns.values():
        column.setflags(write=False)
    lost = f"{total.lost} of {case.interface.contacts} contacts {_ENDINGS[total.ending]}: {total.outcome.message}"
    record = FrictionRecord(
        **columns,
        normal_load=case.total_load,
        spacing=case.slab.spacing if case.effects.pin_translation else math.inf,
        node_area=case.slab.node_area,
        presliding_length=total.presliding_length,
        initial_force=float(force[0]),
        initial_stiffness=total.stiffness * share,
        initial_slips=total.initial_slips,
        initial_contact_size=int(total.contact_size[0]),
        end_nodes=total.end_nodes,
        final_displacement=total.end,
        final_force=float(force[-1]),
        outcome=Outcome(Ending.COMPLETED, lost, cause=total.outcome.kind) if total.lost else COMPLETED,
    )
    validity = Validity(total.validity_flags, total.half_width / total.contacts)
    statistics = _statistics(record, total)
    return Slider(validity, statistics, record, float(total.highest.max()) * share, total.lost)


def _statistics(record: FrictionRecord, total: Portion) -> EventStatistics:
    """Statistics of the events of all contacts. record: of their sum, whose events are the pieces it is read at.

    Each number is given here: that of the record itself, as `event_statistics` has it, would count pieces.
    """
    per_event = 1.0 / total.events if total.events else math.nan
    return EventStatistics(
        peak_friction=record.highest_force / record.normal_load if record.final_displacement > 0.0 else math.nan,
        surface_stiffness=record.initial_stiffness,
        spacings=record.final_displacement / record.spacing,
        presliding_lengths=record.presliding_lengths,
        cascade_slips=int(record.slips.sum()),
        cascade_releases=int(record.releases.sum()),
        cascade_touches=int(record.touches.sum()),
        dissipated=float(record.dissipated.sum()),
        events=total.events,
        cycle_events=0,
        cycle_spacings=0.0,
        slips=total.slip_events,
        releases=total.release_events,
        touches=total.touch_events,
        mean_step=total.end * per_event,
        mean_slips=float(total.slips.sum()) * per_event,
        mean_drop=total.fallen / total.load * per_event,
    )


def interface(case: Case, compliance: Compliance) -> Slider:
    """All contacts of a case, summed in this process."""
    return slider(case, (portion(case, compliance, *batch) for batch in batches(case.interface.contacts)))
