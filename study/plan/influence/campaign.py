"""What a campaign may leave out of its cases, and what is left out of each."""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, NamedTuple

from solver.case import Case, Effects
from solver.drive import Drive
from solver.parameter import declared
from solver.slab import Slab
from study.manifest.cases import CampaignCase
from study.manifest.drives import CampaignDrive
from study.manifest.manifest import Manifest, WrongManifestError
from study.manifest.problems import ManifestError, shown
from study.manifest.reader import load_manifest, parse_manifest
from study.plan.influence.decision import Decision, Tolerance, decide
from study.plan.influence.length import WHOLE_LENGTH
from study.plan.influence.omissions import OF_THE_DRIVE, OMISSIONS
from study.plan.influence.scene import ASKED_FOR, OBSERVABLES, Scene
from study.plan.influence.table import load_influences
from study.plan.kinds.kind import declared as scalars_of
from study.plan.tasks import KINDS


def read(path: Path) -> Manifest:
    """Read a campaign file as `load_manifest` does. Raises ManifestError, with problems of its tolerance beside all others."""
    return _checked(lambda: load_manifest(path))


def parse(path: Path, text: str, beside: Mapping[str, str]) -> Manifest:
    """The same of texts, as `parse_manifest` does."""
    return _checked(lambda: parse_manifest(path, text, beside))


def _checked(read: Callable[[], Manifest]) -> Manifest:
    try:
        manifest = read()
    except WrongManifestError as error:
        raise ManifestError([*error.lines, *_problems(error.manifest)]) from None
    if problems := list(_problems(manifest)):
        raise ManifestError(problems)
    return manifest


def tolerance_of(manifest: Manifest) -> Tolerance | None:
    """What a campaign may leave out; None where it names no tolerance. Raises ManifestError."""
    tolerated = manifest.tolerated
    if tolerated is None:
        return None
    of_stage = ASKED_FOR[manifest.stages[-1]]
    problems = list(_problems(manifest))
    if problems:
        raise ManifestError(problems)
    return Tolerance(
        within=tolerated.within,
        asked_for=tolerated.observables or of_stage,
        kept=frozenset((*tolerated.keep, *_given(manifest))),
        influences=load_influences(tolerated.influences, tolerated.influences_text),
        slides="slip" in manifest.stages,
        fitted=manifest.outputs.fit,
        cases_on_a_slab=_cases_on_a_slab(manifest),
        lengths_stay=_why_lengths_stay(manifest),
    )


def _problems(manifest: Manifest) -> Iterator[str]:
    if manifest.tolerated is None:
        return
    yields = yielded(manifest)
    for name in manifest.tolerated.observables:
        if name not in yields:
            where = f"{manifest.path}: effects.observables = {shown(name)}"
            yield f"{where}: needs one of {', '.join(yields)}"
    for name in manifest.tolerated.keep:
        if name not in (*OMISSIONS, WHOLE_LENGTH):
            needed = ", ".join((*OMISSIONS, WHOLE_LENGTH))
            yield f"{manifest.path}: effects.keep = {shown(name)}: needs one of {needed}"


def yielded(manifest: Manifest) -> tuple[str, ...]:
    """The observables that the dataset of a campaign has."""
    kinds = [kind for kind in KINDS.values() if kind.needed(manifest)]
    there = {quantity.name for kind in kinds for quantity in scalars_of(kind).values()}
    return tuple(name for name in OBSERVABLES if name in there)


def _given(manifest: Manifest) -> Iterator[str]:
    """Effects that the file itself sets on or off, and those that its outputs need."""
    yield from (name for name in declared(Effects) if name in manifest.effects.keys() | manifest.axes.keys())
    if manifest.accuracy is None and "scheme" in manifest.numerics.keys() | manifest.axes.keys():
        yield "finite_slab"
    if manifest.outputs.subsurface:
        yield "finite_slab"


def _why_lengths_stay(manifest: Manifest) -> str:
    """Why a campaign needs whole lengths; empty where it does not."""
    outputs = manifest.outputs
    if outputs.statistics or outputs.tractions_at:
        return f"outputs.{'statistics' if outputs.statistics else 'tractions_at'} needs it"
    return "an ensemble grows until it knows enough" if manifest.ensemble.uncertainty is not None else ""


def _cases_on_a_slab(manifest: Manifest) -> float:
    """How many cases share a compliance, on average."""
    slab = {name: values for name, values in manifest.axes.items() if name in declared(Slab)}
    if manifest.design == "product":
        total = math.prod(len(values) for values in manifest.axes.values())
        slabs = math.prod(len(values) for values in slab.values())
    else:
        total = len(next(iter(manifest.axes.values()), ()))
        slabs = len(set(zip(*slab.values(), strict=True))) if slab else 1
    return max(total * manifest.ensemble.members / max(slabs, 1), 1.0)


class _Pulled(NamedTuple):
    """What is different in a drive from what the file says."""

    left_out: tuple[str, ...] = ()
    length_error: float | None = None


@dataclass(slots=True)
class Decider:
    """Decides case after case, and remembers what it decided."""

    manifest: Manifest
    tolerance: Tolerance
    decisions: dict[str, Decision] = field(default_factory=dict)
    """case_id -> what was decided of it."""
    drives: Mapping[str, Drive] = field(init=False)
    """Label -> how the campaign pulls its pins, in the solver's units."""
    _kept: Mapping[str, frozenset[str]] = field(init=False)
    """Label of a drive -> effects that its table asks for."""
    _alike: dict[Case, Decision] = field(default_factory=dict)
    _manifests: dict[tuple[_Pulled, ...], Manifest] = field(default_factory=dict)

    def __post_init__(self) -> None:
        scales, drives = self.manifest.scales, self.manifest.drives
        self.drives = {each.label: each.drive.dimensionless(scales) for each in drives if each.drive}
        self._kept = {each.label: frozenset(_asked_by(each)) for each in drives}

    def decided(self, case: CampaignCase) -> CampaignCase:
        """The case without what does not matter; the same where it is refused."""
        if case.case is None:
            return case
        found = self._decision(case.case)
        self.decisions[case.case_id] = found
        return replace(case, case=found.case)

    def manifest_of(self, case: CampaignCase) -> Manifest:
        """The manifest with the drives as they pull this case."""
        found = self.decisions.get(case.case_id)
        if found is None or not self.manifest.drives:
            return self.manifest
        drives = self.manifest.drives
        pulled = tuple(_Pulled(*found.of_drive(each.label)) if each.drive else _Pulled() for each in drives)
        if pulled not in self._manifests:
            if len(self._manifests) >= _REMEMBERED:
                self._manifests.clear()
            changed = tuple(_changed(drive, how) for drive, how in zip(drives, pulled, strict=True))
            self._manifests[pulled] = replace(self.manifest, drives=changed)
        return self._manifests[pulled]

    def _decision(self, case: Case) -> Decision:
        # Members of an ensemble are to be the same model.
        first = case
        if case.start or case.heterogeneity.seed != 1:
            first = replace(case, start=0.0, heterogeneity=replace(case.heterogeneity, seed=1))
        if first not in self._alike:
            if len(self._alike) >= _REMEMBERED:
                self._alike.clear()
            self._alike[first] = decide(first, self.drives, self._kept, self.tolerance)
        found = self._alike[first]
        if first is case:
            return found if found.asked is case else replace(found, asked=case)
        drawn = replace(found.case.heterogeneity, seed=case.heterogeneity.seed)
        return replace(found, asked=case, case=replace(found.case, start=case.start, heterogeneity=drawn))


_REMEMBERED: Final = 4096


def _asked_by(drive: CampaignDrive) -> Iterator[str]:
    keys = {"surface_compliance": "surface_compliance", "reverse_motion": "reverse_motion", "teeth": "profile"}
    return (name for name, key in keys.items() if key in drive.given)


def _changed(drive: CampaignDrive, pulled: _Pulled) -> CampaignDrive:
    """A drive of the campaign, in SI, as a case is pulled by it."""
    if drive.drive is None or pulled == _Pulled():
        return drive
    in_si = drive.drive.in_si
    if pulled.length_error is not None:
        in_si = replace(in_si, length_error=pulled.length_error)
    for omission in OF_THE_DRIVE:
        if omission.name in pulled.left_out:
            without = omission.left_out(Scene(Case(), in_si)).drive
            assert without is not None
            in_si = without
    return replace(drive, drive=replace(drive.drive, in_si=in_si))
