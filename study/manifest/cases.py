"""Expand a campaign into cases: one for each combination of its axes (product), each position (zip) or each line of its table."""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

from solver.case import Case
from solver.outcome import COMPLETED, InvalidInput, Outcome
from study.manifest.effects import refusal
from study.manifest.manifest import Manifest
from study.manifest.parameters import STANDARD, Value, in_words, make_case
from study.manifest.problems import ManifestError
from study.provenance import content_hash

MEMBER = "member"
"""Label of a case of an ensemble, beside its parameters: its number among the members, from 0."""


@dataclass(frozen=True, slots=True)
class CampaignCase:
    """One point of a campaign: its parameters, and the case that they make."""

    case_id: str
    """Hash of all parameters, 12 hexadecimal digits. The same point has the same hash in every campaign."""
    parameters: dict[str, Value]
    """Labels by field name: the four standard parameters, every axis, and the member's number where there are several."""
    case: Case | None
    """None where the case is refused, as its parameters exclude each other."""
    outcome: Outcome
    """COMPLETED, or the reason why the case is refused, with advice."""

    @property
    def point(self) -> str:
        """Its labels as text in the words of a manifest: `radius = 200.0, events = 5`."""
        return in_words(", ".join(f"{name} = {value}" for name, value in self.parameters.items()))


def expand(manifest: Manifest) -> tuple[CampaignCase, ...]:
    """All cases of a campaign, the last axis varying fastest. Raises ManifestError where two cases are the same."""
    members = range(manifest.ensemble.members)
    cases = tuple(_campaign_case(manifest, point, member) for point in _points(manifest) for member in members)
    numbers: dict[str, int] = {}
    problems = []
    for number, case in enumerate(cases, 1):
        first = numbers.setdefault(case.case_id, number)
        if first != number:
            problems.append(f"{manifest.path}: cases {first} and {number} are the same: {case.point}")
    if problems:
        raise ManifestError(problems)
    return cases


def _points(manifest: Manifest) -> Iterator[dict[str, Value]]:
    combine = itertools.product if manifest.design == "product" else zip
    for values in combine(*manifest.axes.values()):
        yield dict(zip(manifest.axes, values, strict=True))


def _campaign_case(manifest: Manifest, point: dict[str, Value], member: int) -> CampaignCase:
    given = {**manifest.fixed, **point}
    several = manifest.ensemble.members > 1
    try:
        case, outcome = make_case(given), COMPLETED
        if several:
            given |= manifest.ensemble.varied(case, member)
            case = make_case(given)
        if wrong := refusal(manifest, case):
            raise InvalidInput(wrong)
    except InvalidInput as error:
        case, outcome = None, error.outcome
    full = case.flat if case else {**Case.of({}).flat, **given, **({MEMBER: member} if several else {})}
    standard = {name: full[name] for name in STANDARD}
    labels = {name: value for name, value in {**standard, **point}.items() if value is not None}
    if several:
        labels[MEMBER] = member
    return CampaignCase(content_hash("case", full, length=12), labels, case, outcome)
