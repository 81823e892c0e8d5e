"""What a stretch of a friction record can know of a mean: a model of its uncertainty, measured over cases and starts.

What the pin meets repeats with the nodes of the surface, so all that is read off a record depends on where in a node spacing
the pin is, and one spacing is the longest correlation length there is. Over a stretch that is shorter, blocks agree
with each other and say nothing of the rest of the spacing: what they miss is taken from the model here. Over whole spacings
the modulation averages out, and what is left of it falls as one over their number. Most records are not the same in every
spacing: the scatter of their means is seen, and falls as the root of their number, unless neighbours are alike: then it is that
between groups of them, which knows of a drift. Where the contact is at an end of the surface nothing repeats, and nothing is
known. Where surface nodes give way together, as on a nearly incompressible slab of finite elements, a contact counts as one of
fewer nodes. A record that is the same has found a cycle;
another start may find another one, of which more of the same says nothing. Constants and how well the result keeps its
promise: tests/verification/calibration.
"""

import math
from dataclasses import dataclass
from typing import Final, NamedTuple

import numpy as np
import scipy
from numpy.typing import NDArray

from solver.case import Case

MODULATION: Final = 0.32
"""Standard deviation of the friction force over a node spacing, of its mean, times nodes in contact over what a slip drops."""
EVENT_MODULATION: Final = 0.7
"""The same of step and force drop per event, of their means; that it depends on the contact little was measured."""
PEAK_MODULATION: Final = 1.1
"""The same of the force at which a pin first slides, between starts."""
OVERSHOOT: Final = 0.06
"""The same where that force is above all that the plateau repeats: initial contact then gives way as a whole, at a force that
differs by up to 40 % with where between two nodes the pin came down. One start does not tell whether its own is a high one."""
DISORDER: Final = 1.3
"""Standard deviation of the mean force between seeds, of its mean, times √nodes over the spread of μ_i."""
LEFT_OVER: Final = 1.3
"""What of the standard error of blocks is left of a mean over one whole spacing, of whose blocks the most is modulation."""
EVENLY: Final = 0.6
"""What of the standard error of independent members is left where their starts are spread evenly."""
SHARED: Final = (0.3, 0.7)
"""Part of the uncertainty that each member states that all members have in common, from half a node spacing on the second: below,
most of what a member states is the modulation, which evenly spread starts average out. So much that twice the mean's holds where
ensembles end as soon as they know enough, as those do first that state too little."""
HELD: Final = 0.95
"""How often twice the uncertainty of few members holds."""
EXPECTED_BLOCKS: Final = 32
"""Blocks that a mean force is expected to have."""
BETWEEN: Final = 0.045
"""Standard deviation between the means over single node spacings that is to be expected, of their mean, times nodes in contact
over what a slip drops."""
WANDER: Final = 1.0
"""Standard deviation by which the mean force of a stretch twice as long is another one because other nodes are met, of it, times
nodes over the root of the spread of μ_i: after each spacing one of the nodes in contact is another one."""
CYCLE: Final = 0.002
"""The same where spacing after spacing is the same but for what initial contact left: the record has found a cycle."""
CYCLES: Final = 0.03
"""The same between the cycles that starts find: 0 of most cases, 0.06 of some."""
SEEN: Final = 0.09
"""Standard error of blocks over nearly a node spacing, of their mean, times nodes in contact over what a slip drops."""
KNOWN: Final = 0.2
"""Node spacings below which step and drop per event are not known: elsewhere along a spacing they are several times as large."""
EVENT_LEFT_OVER: Final = 0.05
"""Uncertainty of step and drop per event over a spacing or more, beside what events tell, of their means, times its length."""
EVENT_ALONE: Final = 0.15
"""The same of less than one."""
EVENT_DISORDER: Final = 1.7
"""How much more step and drop per event differ between seeds than the mean force does."""
CONFINED: Final = 11.5
"""(λ+2G)/G, that of ν = 0.4524, from which on surface nodes give way as one, the more of them the larger it is: the force
within a node spacing varies by 0.2, 0.14, 0.5, 1.0 of the plateau over nodes in contact (medians at ν = 1/3, 0.45, 0.48, 0.49),
as if so many fewer nodes were there."""
MOST_TAKEN_ALONG: Final = 2.5
"""Surface nodes as one (ν = 0.4823) above which those that slip all at once overshoot: the mean force then differs by up to a
quarter from one node spacing to the next, in contacts of 11 to 38 nodes alike."""


def scatter(values: NDArray[np.float64]) -> float:
    """Standard deviation of independent values, at least two: `np.std` with its bits, in half its time where they are few."""
    off = values - values.sum() / len(values)
    return math.sqrt(float((off * off).sum()) / (len(values) - 1))


def nodes_as_one(case: Case) -> float:
    """How many surface nodes give way as one, as far as uncertainties are concerned: 1 where each does so alone.

    Where all that may slip do so at once, those that the slab takes along are taken along once more; infinite where that
    has no bounds.
    """
    taken: float = max(1.0, case.slab.scheme.confinement(case.slab) / CONFINED)
    if case.slip_rule.slip_order != "simultaneous" or case.slip_rule.residual_shear == 1.0:
        return taken
    return taken**2 if taken <= MOST_TAKEN_ALONG else math.inf


@dataclass(frozen=True, slots=True)
class Sampling:
    """A stretch of a record: its length in node spacings, nodes in contact on average, and the case's slip rule and disorder.

    at_an_end: of the surface is the contact, so that what the pin meets does not repeat. Then no mean is known.
    nodes_as_one: how many nodes give way as one, which makes a contact one of fewer nodes. If infinite, no mean is known either.
    """

    spacings: float
    nodes: float
    residual_shear: float = 0.0
    spread: float = 0.0
    at_an_end: bool = False
    nodes_as_one: float = 1.0

    @property
    def unseen(self) -> float:
        """Share of a modulation over one node spacing that a mean over the stretch has in it: |sin πs|/πs, 0 from s = 1 on."""
        return self._unbalanced if self.spacings < 1.0 else 0.0

    @property
    def _unbalanced(self) -> float:
        """The same where the stretch is not cut to whole spacings: |sin πs|/πs, 0 of whole ones."""
        if not self.spacings:
            return 1.0
        return float(abs(np.sin(math.pi * (self.spacings % 1.0)))) / (math.pi * self.spacings)

    @property
    def discreteness(self) -> float:
        """What a slip drops of one node and of those that give way with it, as a share of the load's friction."""
        return self._alone * self._together

    @property
    def _alone(self) -> float:
        """The same of one node."""
        return (1.0 - self.residual_shear) / max(self.nodes, 1.0)

    @property
    def _together(self) -> float:
        """Nodes that give way as one, at most all. Peaks and events were seen to differ by its root: they are drops of groups."""
        return min(self.nodes_as_one, max(self.nodes, 1.0))

    @property
    def disorder(self) -> float:
        """Relative standard error of a mean force because other nodes would have had other μ_i."""
        nodes = max(self.nodes, 1.0)
        return DISORDER * self.spread / math.sqrt(nodes + self.spacings)

    @property
    def wandering(self) -> float:
        """The same because a longer stretch would meet other nodes: 0 of a pin that goes on meeting the same."""
        return WANDER * math.sqrt(self.spread) / max(self.nodes, 1.0) if self.spacings else 0.0

    @property
    def drawn(self) -> float:
        """The part of the relative standard error of a mean force that is the draw of the nodes' μ_i: seeds differ by it."""
        return math.hypot(self.disorder, self.wandering)

    @property
    def expected_of_mean_force(self) -> float:
        """The same as far as it is known before there are blocks, to a factor of two."""
        if self.spacings >= 1.0:
            whole = math.floor(self.spacings)
            left_over = LEFT_OVER * MODULATION / math.sqrt(EXPECTED_BLOCKS) / whole
            sampled = math.hypot(left_over, BETWEEN / math.sqrt(whole))
        else:
            sampled = math.hypot(self.unseen * MODULATION, SEEN * self.spacings, BETWEEN)
        return math.hypot(sampled * self.discreteness, self.wandering, self.disorder)

    def of_mean_force(
        self, blocks: NDArray[np.float64], within: float, spacings: NDArray[np.float64] | None = None
    ) -> float:
        """Standard error of the mean force over the stretch, from its block means (b,) and their own standard error `within`.

        spacings: means over its single spacings, where it is two whole ones or more.
        """
        return self.with_disorder(self.of_length(blocks, within, spacings), float(blocks.mean()))

    def with_disorder(self, of_length: float, mean: float) -> float:
        """The same from its part `of_length` and the mean."""
        return math.hypot(of_length, self.disorder * abs(mean))

    def of_length(
        self, blocks: NDArray[np.float64], within: float, spacings: NDArray[np.float64] | None = None
    ) -> float:
        """The same without what other nodes' μ_i would change, of which a longer stretch says nothing.

        NaN at an end of the surface, and where there is no bound to how many nodes give way as one.
        """
        if self.at_an_end or math.isinf(self.nodes_as_one):
            return math.nan
        mean, seen = abs(float(blocks.mean())), scatter(blocks)
        unknown = self._between(mean, spacings), self.wandering * mean
        if self.spacings >= 1.0:
            return math.hypot(LEFT_OVER * seen / math.sqrt(len(blocks)) / math.floor(self.spacings), *unknown)
        # What was seen of the modulation tells its size the better the more of a spacing it was.
        share = self.spacings**2
        modulation = math.hypot(math.sqrt(1.0 - share) * MODULATION * self.discreteness * mean, math.sqrt(share) * seen)
        return math.hypot(within, self.unseen * modulation, *unknown)

    def _between(self, mean: float, spacings: NDArray[np.float64] | None) -> float:
        """Standard error of the mean force because single spacings differ, from their means (k,).

        Fewer than two do not say by how much: it is what is to be expected.
        """
        size = self.discreteness * mean
        if spacings is None:
            return BETWEEN * size
        scattered, count = scatter(spacings), len(spacings)
        if scattered < CYCLE * size:
            return CYCLES * size
        # A few may be alike by chance: what is to be expected counts as one of them.
        independent = math.sqrt((count - 1) * scattered**2 + (BETWEEN * size) ** 2) / count
        return max(independent, _of_groups(spacings))

    def of_events(self) -> float:
        """Relative standard error of step and drop per event over the stretch, NaN below KNOWN; of disorder alone where slips
        drop nothing."""
        if self.at_an_end or math.isinf(self.nodes_as_one):
            return math.nan
        if self.residual_shear == 1.0:
            return self.disorder
        if self.spacings < KNOWN:
            return math.nan
        left_over = EVENT_LEFT_OVER / self.spacings if self.spacings >= 1.0 else EVENT_ALONE
        modulation = self._unbalanced * EVENT_MODULATION
        return math.hypot(modulation, math.sqrt(self._together) * left_over, EVENT_DISORDER * self.disorder)

    def of_peak(self, above: float = 0.0) -> float:
        """Relative standard deviation, between starts, of the force at which a pin first slides.

        above: share of that force by which it is more than all that the plateau repeats, to which twice the uncertainty reaches
        back then; 0 or less where it is not. Slips that drop nothing have no such peak.
        """
        modulation = PEAK_MODULATION * self._alone * math.sqrt(self._together)
        if above > 0.0 and self.residual_shear < 1.0:
            modulation = max(modulation, OVERSHOOT, above / 2.0)
        return math.hypot(modulation, DISORDER * self.spread / math.sqrt(max(self.nodes, 1.0)))


def _of_groups(spacings: NDArray[np.float64]) -> float:
    """Largest standard error of the mean from two groups of neighbours, four, eight, …: 0 of fewer than four spacings.

    Neighbours that are alike count as what they are, less than as many independent ones. Twice that of a force that rises all
    along contains its values at both ends.
    """
    largest, size = 0.0, len(spacings) // 2
    while size > 1:
        groups = len(spacings) // size
        means = spacings[len(spacings) - groups * size :].reshape(groups, size).mean(axis=1)
        largest, size = max(largest, scatter(means) / math.sqrt(groups)), size // 2
    return largest


class Members(NamedTuple):
    """What is known of the members of an ensemble, arrays (m,)."""

    values: NDArray[np.float64]
    """NaN where a member has none."""
    stated: NDArray[np.float64]
    """Their own uncertainties."""
    common: NDArray[np.float64]
    """The part of them that all members have alike."""
    spacings: NDArray[np.float64]
    """Node spacings that they span, NaN where not known."""
    drawn: NDArray[np.float64]
    """The part of a mean force's relative uncertainty that is the draw of μ_i, NaN where not known."""

    def of(self, which: slice | NDArray[np.bool_]) -> "Members":
        """Some of them."""
        return Members(*(each[which] for each in self))


def uncertainty_of_members(kind: str, members: Members) -> float:
    """Standard error of the mean over members, with all of what they have in common. NaN where it is not known.

    kind: what members know of it (`Quantity.ensemble`).
    """
    values, stated, common = members[:3]
    there = np.isfinite(values)
    own = np.sqrt(np.maximum(stated**2 - common**2, 0.0))
    if kind == "fitted" and not np.isfinite(own[there]).all():
        return math.nan
    if kind == "event":
        apart = scatter_uncertainty(values)
    elif kind in ("independent", "fitted"):
        apart = independent_uncertainty(values)
    else:
        known = members.spacings[np.isfinite(members.spacings)]
        by_seed = np.nan_to_num(members.drawn) if kind == "mean" else np.zeros(len(values))
        apart = ensemble_uncertainty(values, own, float(np.mean(known)) if len(known) else 0.0, by_seed)
    return float(np.hypot(apart, np.mean(common[there]) if there.any() else math.nan))


def ensemble_uncertainty(
    values: NDArray[np.float64], stated: NDArray[np.float64], spacings: float, drawn: NDArray[np.float64] | None = None
) -> float:
    """Standard error of the mean over members (m,) whose starts are spread evenly over a node spacing; NaN of fewer than 2.

    stated: the members' own uncertainties (m,), NaN where one states none. Where a member that has a value does so, the mean's is
    not known either: of ensembles some of whose members are at an end of the surface twice ± would hold in six of ten.
    spacings: what a member spans, in node spacings. drawn: the part of what members state, over their values (m,), that is the
    draw of their nodes' μ_i. Each has a seed of its own: they have nothing of it in common, and even starts average
    nothing out. A few may agree by chance, so the mean's is never less than by what each states of it.
    Members without a value (NaN) are left out; then phases are missing, and all of the scatter counts as chance.
    """
    there = np.isfinite(values)
    found, own = values[there], stated[there]
    if len(found) < 2 or not np.isfinite(own).all():
        return math.nan
    by_seed = np.zeros(len(found)) if drawn is None else drawn[there]
    even = EVENLY if len(found) == len(values) and not by_seed.any() else 1.0
    shared = SHARED[spacings >= 0.5] * float(np.median(np.sqrt(np.maximum(own**2 - (by_seed * found) ** 2, 0.0))))
    least = float(np.median(by_seed * abs(found))) / math.sqrt(len(found))
    return math.hypot(max(even * _of_independent(found), least), shared)


def scatter_uncertainty(values: NDArray[np.float64]) -> float:
    """Standard error of the mean over members (m,) of what is one event of each, as of independent ones.

    NaN of fewer than 2, and where one has no value: a pin that has not slipped would have had a large one.
    """
    if len(values) < 2 or not np.isfinite(values).all():
        return math.nan
    return _of_independent(values)


def independent_uncertainty(values: NDArray[np.float64]) -> float:
    """Standard error of the mean over the members (m,) that have a value, as of independent ones; NaN of fewer than 2."""
    found = values[np.isfinite(values)]
    return _of_independent(found) if len(found) > 1 else math.nan


def _of_independent(values: NDArray[np.float64]) -> float:
    """Standard error of the mean of two values or more."""
    return student(len(values)) * scatter(values) / math.sqrt(len(values))


def student(members: int) -> float:
    """By how much more the standard error of so many counts, of which the scatter is not known but seen: twice it is to hold as
    often as it does of many."""
    return float(scipy.special.stdtrit(members - 1, 0.5 + 0.5 * HELD)) / 2.0


def expected_of_ensemble(member: float, spacings: float, members: int, drawn: float = 0.0) -> float:
    """The same as far as it is known before there are records: members are expected to scatter by what each of them states."""
    even = 1.0 if drawn else EVENLY
    shared = SHARED[spacings >= 0.5] * math.sqrt(max(member**2 - drawn**2, 0.0))
    return math.hypot(member * even * student(members) / math.sqrt(members), shared)
