"""A plan a piece at a time: the cases of a campaign are made again from its axes, so that of millions few are held."""

from collections.abc import Iterator, Mapping
from typing import Final, Protocol

from nanoslip.solver.outcome import Outcome
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.plan.grids import settled
from nanoslip.study.plan.plan import Plan, Planning, plan_of

CASES: Final = 4096
"""Of a piece, about."""


class Planned(Protocol):
    """A campaign whose cases and keys can be had a piece at a time: a plan, or `InPieces`."""

    @property
    def manifest(self) -> Manifest:
        """With the numerics that were chosen."""

    @property
    def count(self) -> int:
        """How many cases there are."""

    def piece(self, numbers: range) -> Plan:
        """The plan of the cases of these numbers, without tasks."""

    def outcomes(self, finished: Mapping[str, Outcome], failed: Mapping[str, Outcome]) -> dict[str, Outcome]:
        """As `Plan.outcomes`."""


class InPieces:
    """A campaign that is planned a piece at a time, none of which is kept."""

    def __init__(self, manifest: Manifest) -> None:
        """Raises ManifestError."""
        self.manifest: Manifest = settled(manifest)

    @property
    def count(self) -> int:
        """How many cases there are."""
        return self.manifest.case_count

    def piece(self, numbers: range) -> Plan:
        """The plan of the cases of these numbers, without tasks."""
        planning = Planning(self.manifest, tasks=False, numbers=numbers)
        while planning.go_on():
            pass
        return planning.plan()

    def outcomes(self, finished: Mapping[str, Outcome], failed: Mapping[str, Outcome]) -> dict[str, Outcome]:
        """As `Plan.outcomes`; all is planned for it. Raises ManifestError where two cases are the same."""
        return plan_of(self.manifest).outcomes(finished, failed)


def pieces(plan: Planned) -> Iterator[range]:
    """The numbers of its cases, piece by piece."""
    return (range(begin, min(begin + CASES, plan.count)) for begin in range(0, plan.count, CASES))
