"""The answer of a case in a line: friction with the ± of its starts, and what decides it beside them."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import numpy as np
import xarray as xr

from nanoslip.solver.parameter import SHARED_ERROR
from nanoslip.study.accuracy.deciding import MAIN, SECONDS, Deciding, deciding, deciding_words
from nanoslip.study.dataset.variables import fewer
from nanoslip.study.manifest.cases import CampaignCase, expand
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import compact
from nanoslip.study.report import summary
from nanoslip.study.report.console import Table


def decided(
    case: xr.Dataset, manifest: Manifest, of: CampaignCase, out: Path | None, most: float = SECONDS
) -> Deciding | None:
    """Influences on a computed case beside its starts; None if its main number is unknown. out, most: see `deciding`."""
    if of.case is not None:
        for main in ("critical_velocity", MAIN["slip" in manifest.stages]):
            if main in case and not case[main].dims and math.isfinite(float(case[main])):
                return deciding(manifest, of, main, most, out)
    return None


def answer_of(case: xr.Dataset, manifest: Manifest, of: CampaignCase, out: Path | None = None) -> str:
    """Friction of a case with its ±, and what decides it beside the starts, in a line. out: see `deciding`."""
    answer, names, found = summary.answer(case), list(summary.answered(case)), decided(case, manifest, of, out)
    if found is None:
        return answer
    title = summary.SHOWN[found.variable] if found.variable in MAIN else case[found.variable].attrs["symbol"]
    named = "" if names[:1] == [found.variable] else f"{title} "
    if "critical_velocity" in case:
        answer, names = f"{critical_words(case)}; {answer}", ["critical_velocity", *names]
    known = (float(case.get(f"{name}_uncertainty", 0.0)) for name in names)
    by = " (± by starts alone)" if any(0.0 < each < math.inf for each in known) else ""
    return "; ".join([f"{answer}{by}", *deciding_words(found, named)])


def critical_words(case: xr.Dataset) -> str:
    """Critical velocity at the drive's stiffness in a sentence, with its ±; if it is unknown, the stiffness at its velocity.

    Both together would contradict each other where stick-slip is a band of velocities.
    """
    velocity, stiffness = ("stage_velocity", "stage velocity", "m/s"), ("spring_stiffness", "stiffness", "N/m")
    for name, (_, what, unit), (other, _, its) in (
        ("critical_velocity", velocity, stiffness),
        ("critical_stiffness", stiffness, velocity),
    ):
        value, error = (float(case.get(each, math.nan)) for each in (name, f"{name}_uncertainty"))
        if math.isfinite(value):
            known = f"{compact(value, unit, error)}{fewer(case, name)}"
            return f"no stick-slip above {what} {known} at {compact(float(case[other]), its)}"
    return "no critical point: the pin sticks at all or at none of the velocities and stiffnesses tried"


def middle_answer(dataset: xr.Dataset, manifest: Manifest, out: Path) -> str:
    """The answer of a campaign's middle case that is possible, with its parameters; empty if there is none.

    out: folder of the campaign.
    """
    possible = [each for each in expand(manifest) if each.case]
    if not possible:
        return ""
    middle = possible[len(possible) // 2]
    ids = dataset["case_id"]
    place = dict(zip(ids.dims, np.argwhere(ids.values == middle.case_id)[0].tolist(), strict=True))
    case = dataset.isel(place).squeeze()
    parameters = {name: middle.parameters[name] for name in manifest.axes if name in middle.parameters}
    where = (
        f"The middle case, {summary.label_text(parameters, manifest.stated_scales)}" if len(possible) > 1 else "Answer"
    )
    answer = answer_of(case, manifest, middle, out)
    return f"{where}: {answer}." if answer else ""


# `nanoslip explain`: everything that decides the main number of a case, the largest first.

_HEADER = ("what decides", "by", "to know better")
NOT_MEASURED: Final = "not measured"
"""Cell of a share that nothing here computes."""


def ranking(
    case: xr.Dataset, manifest: Manifest, of: CampaignCase, cost: str, most: float, out: Path
) -> tuple[str, Table] | None:
    """The main number of a case with its value, and what decides it, the largest first; None if it is unknown.

    cost: of four times its members, in words. most, out: see `deciding`.
    """
    found = decided(case, manifest, of, out, most)
    if found is None:
        return None
    name, value = found.variable, float(case[found.variable])
    errors = [*summary.errors_of(case, name, cost), *_beside(case, found, value)]
    rows = [(each.source, f"{each.share:.1%}", each.cure) for each in sorted(errors, key=lambda each: -each.share)]
    unknown = [(f"{each.word} the node spacing", NOT_MEASURED, each.problem) for each in found.spacings if each.problem]
    assert of.case is not None
    planar = of.case.slab.scheme.planar
    plane = (
        [] if planar else [("the third dimension", NOT_MEASURED, "a scheme in three dimensions: this is plane strain")]
    )
    rows += [*unknown, *plane]
    return f"{summary.SHOWN[name]} {value:.4g}", Table(_HEADER, tuple(rows), labels=2)


def _beside(case: xr.Dataset, found: Deciding, value: float) -> Iterator[summary.Error]:
    """Node spacing, drop of a slip and length of the record as parts of a number's error, where they are known."""
    spacings = " or ".join(each.word for each in found.computed)
    cure = "measure the spacing of what slips on your surface, and set n_x to it"
    if found.computed:
        most = max(abs(each.value / value - 1.0) for each in found.computed)
        yield summary.Error(f"{spacings} the node spacing", most, cure)
    if math.isfinite(found.without_drop):
        cure = "residual_shear from 0 to 1: nanoslip fit finds it from measured friction"
        yield summary.Error("slips that drop no stress", abs(found.without_drop / value - 1.0), cure, plural=True)
    spaced = float(case.get("record_spacings", math.nan))
    if (shared := float(case.get(f"{found.variable}{SHARED_ERROR}", 0.0))) > 0.0:
        cure = f"a longer record: it spans {spaced:.2g} of the node spacings with which the surface repeats"
        yield summary.Error("the record's length", shared / abs(value), f"{cure} (limits.spacings = 2)")
