"""What a target costs and whether it is kept: twenty campaigns drawn by seed, against eight members with everything.

`python -m tests.benchmarks.target [CASES]` computes so many cases of each, evenly spread, and writes tests/benchmarks/target.csv.
Costs are processor seconds of compliances, records and drives. A target is kept where the mean it stopped at is no further from
that of 32 other starts with everything than `within` and twice their own ± together.
"""

import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.duration import measure_motion
from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
from nanoslip.solver.ensemble import FEWEST, Ensemble, Mean, mean_of
from nanoslip.solver.outcome import SolverError
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide
from nanoslip.study.accuracy.effects import measure_time
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.tasks.compliance import compliance_task
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.drive import drive_task
from nanoslip.study.tasks.kind import KINDS, result_quantities
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.task import Task, TaskResult
from tests.written_tables import show

CAMPAIGNS, CASES = 20, 6
DRIVES = 8
WITHIN = (0.1, 0.03, 0.01, 0.003)
FEWEST_CASES = 3
"""Of a campaign in which many drives share a record."""
OTHERS = 32
FIRST_OTHER = 1_000_000
"""Number of the first member of the other starts: no campaign has so many."""
ALONE_KIND, SHARED_KIND, UNDRIVEN_KIND = "a drive", "drives share records", "no drive"
KINDS_OF_CAMPAIGNS = (ALONE_KIND, SHARED_KIND, ALONE_KIND, UNDRIVEN_KIND)


class Campaign(NamedTuple):
    """A campaign without an ensemble, what it is of, and the variables to be known."""

    kind: str
    text: str
    of: tuple[str, ...]


def drawn(number: int) -> Campaign:
    """A campaign of 64 to 343 cases over μ_i, load and radius; 12 to 40 nodes in contact at its middle."""
    rng = np.random.default_rng([30, number])
    kind = KINDS_OF_CAMPAIGNS[number % len(KINDS_OF_CAMPAIGNS)]
    n_x, poisson, middle = int(rng.choice([65, 129])), float(rng.uniform(0.0, 0.38)), 10.0 ** rng.uniform(-4.0, -3.0)
    half_width = min(math.exp(rng.uniform(math.log(12), math.log(40))) / 2 / (n_x - 1), 0.17)
    radius = half_width**2 * math.pi / (2.0 * middle * (1.0 - poisson))
    counts = rng.integers(4, 8, 3)
    friction = np.geomspace(rng.uniform(0.05, 0.3), rng.uniform(0.4, 0.9), counts[0])
    loads, radii = (
        each * np.geomspace(0.6, 1.7, count) for each, count in zip((middle, radius), counts[1:], strict=True)
    )
    spread = float(rng.choice([0.0, 0.0, 0.1, 0.3]))
    axes = {"intrinsic_friction": friction, "normal_load": loads, "radius": radii}
    lines = [
        f'title = "campaign {number}"',
        "[axes]",
        *(f"{name} = {values.round(12).tolist()}" for name, values in axes.items()),
        "[numerics]",
        f"n_x = {n_x}",
        f'scheme = "{rng.choice(["galerkin", "galerkin", "biquadratic", "half_plane"])}"',
        f"[constants]\npoisson = {poisson}\n[heterogeneity]\nspread = {spread}",
        "[outputs]\ntrajectory = false\nphases = false\nfit = false",
    ]
    of: Sequence[str] = ("plateau_mean",)
    if kind != UNDRIVEN_KIND:
        # A stage that goes on for three times what loads the spring to the largest friction, in 20 to 60 periods.
        travel = 3.0 * friction[-1] * loads[-1] * 1e5 / 2e5
        lines += ["[[drives]]", 'name = "pull"', f"stage_travel = {travel}", "spring_stiffness = 2e5"]
        speeds = travel / (2.0 * math.pi * math.sqrt(0.5 / 2e5)) / np.geomspace(20.0, 60.0, 4)
        if kind == SHARED_KIND:
            lines += ["[drive_axes]", f"stage_velocity = {speeds.tolist()}", "damping_ratio = [0.05, 0.2]"]
        else:
            lines += [f"stage_velocity = {speeds[0]}"]
        choices = (
            ("kinetic_friction",),
            ("kinetic_friction",),
            ("plateau_mean", "kinetic_friction"),
            ("static_friction",),
        )
        of = choices[int(rng.integers(len(choices)))]
    return Campaign(kind, "\n".join(lines) + "\n", tuple(of))


@dataclass(frozen=True)
class Judged:
    """A campaign computed to a target, or those of its cases that eight members with everything know so well.

    ratio: seconds over those with everything. kept: of each number asked for whether its mean is no further from that of the
    other starts than `within` and twice their own ± together; NaN where these have none, or the target says that it is not known.
    """

    ratio: float
    kept: np.ndarray
    case: np.ndarray
    """Number of each one's case."""


class Row(NamedTuple):
    """One case: seconds of record and drives, each number asked for with twice its ± and what is left out, and the truth."""

    seconds: float
    found: list[tuple[float, float]]
    truth: list[Mean]

    def is_within(self, within: float) -> bool:
        """Whether all numbers asked for are."""
        return all(doubt <= within * abs(mean) for mean, doubt in self.found)


@dataclass(frozen=True)
class Verdict:
    """A campaign, and how it went with everything (0) and with each target."""

    campaign: Campaign
    shared: float
    """Seconds of compliances."""
    rows: Mapping[float, list[Row]]

    def judged(self, within: float, *, known: bool = False) -> Judged:
        """known: only those cases that eight members with everything know so well."""
        pairs = list(zip(self.rows[within], self.rows[0.0], strict=True))
        if known:
            pairs = [(row, whole) for row, whole in pairs if whole.is_within(within)]
        found = np.array([each for row, _ in pairs for each in row.found]).reshape(-1, 2)
        truth = np.array([(float(one.mean), float(one.uncertainty)) for row, _ in pairs for one in row.truth]).reshape(
            -1, 2
        )
        allowed = np.hypot(within * truth[:, 0], 2.0 * truth[:, 1])
        able = np.isfinite(truth[:, 0]) & (found[:, 1] <= within * np.abs(found[:, 0]))
        kept = np.where(able, np.abs(found[:, 0] - truth[:, 0]) <= allowed, np.nan)
        case = np.repeat(np.arange(len(pairs)), [len(row.found) for row, _ in pairs])
        whole = self.shared + sum(row.seconds for _, row in pairs)
        ratio = (self.shared + sum(row.seconds for row, _ in pairs)) / whole if pairs else math.nan
        return Judged(ratio, kept, case)


def judge(number: int, most_cases: int) -> Verdict:
    """Compute cases of a campaign with everything and to every target."""
    campaign = drawn(number)
    whole = _manifest(campaign.text + "[ensemble]\nmembers = 8\n")
    of = json.dumps(campaign.of)
    aimed = {within: _manifest(f"{campaign.text}[target]\nwithin = {within}\nof = {of}\n") for within in WITHIN}
    possible = [each.case for each in expand(whole) if each.case]
    drives = [each.drive.dimensionless(whole.scales) for each in whole.drives if each.drive]
    count = max(most_cases // max(len(drives), 1), FEWEST_CASES)
    places = np.linspace(0, len(possible) - 1, count).round().astype(int)
    rows: dict[float, list[Row]] = {within: [] for within in (0.0, *WITHIN)}
    slabs: dict[str, tuple[TaskResult, float]] = {}
    for case in (possible[place] for place in places):
        slab = compliance_task(case.slab)
        if slab.key not in slabs:
            slabs[slab.key] = _done(slab, {})
            for manifest in (whole, *aimed.values()):  # loads libraries and kernels
                _computed(case, drives[:1], replace(manifest.ensemble, members=FEWEST), slabs[slab.key][0])
        compliance = slabs[slab.key][0]
        others = list(_others(case, drives, campaign.of))
        for within, manifest in ((0.0, whole), *aimed.items()):
            results, seconds = _computed(case, drives, manifest.ensemble, compliance)
            found = [_mean(name, result) for result in results for name in campaign.of if name in _names(result)]
            rows[within].append(Row(seconds, found, others))
    shared = sum(seconds for _, seconds in slabs.values())
    return Verdict(campaign, shared, rows)


def _manifest(text: str) -> Manifest:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "campaign.toml"
        path.write_text(text, "utf-8")
        return load_manifest(path)


def _done(task: Task, results: Mapping[str, TaskResult]) -> tuple[TaskResult, float]:
    """A task's result and seconds; its arrays are read-only, as a store gives them: kernels are compiled for that."""
    result, seconds = measure_time(partial(run_task, task, {key: results[key] for key in task.needs}))
    for array in result.arrays.values():
        array.setflags(write=False)
    return result, seconds


def _computed(
    case: Case, drives: Sequence[Drive], ensemble: Ensemble, compliance: TaskResult
) -> tuple[list[TaskResult], float]:
    """The record of a case and its drives."""
    results, total = {compliance.key: compliance}, 0.0
    tasks = [record_task(case, ensemble)]
    tasks += [drive_task(case, drive, ensemble, scalars_only=True, fitted=False) for drive in drives]
    for task in tasks:
        results[task.key], seconds = _done(task, results)
        total += seconds
    return [results[task.key] for task in tasks], total


def _names(result: TaskResult) -> set[str]:
    return {each.name for each in result_quantities(KINDS[result.kind]).values()}


def _mean(name: str, result: TaskResult) -> tuple[float, float]:
    """The mean of a number, and twice its ± and what is left out of it."""
    key = next(key for key, each in result_quantities(KINDS[result.kind]).items() if each.name == name)
    mean = mean_of(np.array(result.scalars.get(key, [math.nan]), float))
    left_out = float(result.scalars.get("left_out_error", [0.0])[0])
    return float(mean.mean), 2.0 * float(mean.uncertainty) + left_out * abs(float(mean.mean))


def _others(case: Case, drives: Sequence[Drive], names: Sequence[str]) -> Iterator[Mean]:
    """The means of the other starts with everything, in the order of the results of `_computed`."""
    compliance, ensemble = surface_compliance(case.slab), Ensemble(2)
    rows = [_member(ensemble.case(case, FIRST_OTHER + number), drives, compliance) for number in range(OTHERS)]
    for name in names:
        if name == "plateau_mean":
            yield mean_of(np.array([plateau for plateau, _ in rows]))
    for place in range(len(drives)):
        for name in names:
            if name != "plateau_mean":
                yield mean_of(np.array([found[place][name] for _, found in rows]))


def _member(case: Case, drives: Sequence[Drive], compliance: SurfaceCompliance) -> tuple[float, list[dict[str, float]]]:
    nothing = {"static_friction": math.nan, "kinetic_friction": math.nan}
    try:
        record = slide(case, compliance)
    except SolverError:
        return math.nan, [nothing] * len(drives)
    plateau, found = plateau_of(record), []
    for drive in drives:
        try:
            _, friction = measure_motion(record, plateau, drive)
            found.append({name: getattr(friction, name) for name in nothing})
        except SolverError:
            found.append(nothing)
    return plateau.mean, found


def table(verdicts: Sequence[Verdict]) -> Iterator[tuple[str, ...]]:
    """What the campaigns come to, for each target."""
    yield "of cases", "number", *(f"{100.0 * within:g} %" for within in WITHIN)
    for known, title in ((True, "in which 8 members suffice"), (False, "all")):
        columns = [
            list(_summary([(each.campaign.kind, each.judged(within, known=known)) for each in verdicts]))
            for within in WITHIN
        ]
        yield from ((title, *row) for row in zip(SUMMARY, *columns, strict=True))


SUMMARY = (
    "cost over 8 members, median with drives",
    "median with drives that share records",
    "median without drives",
    "most expensive campaign",
    "target met, mean over cases",
)


def _summary(found: Sequence[tuple[str, Judged]]) -> Iterator[str]:
    """The cells of one target."""
    for kinds in ((ALONE_KIND, SHARED_KIND), (SHARED_KIND,), (UNDRIVEN_KIND,)):
        ratios = [each.ratio for kind, each in found if kind in kinds and math.isfinite(each.ratio)]
        yield f"{np.median(ratios):.2f}" if ratios else "–"
    yield f"{max((each.ratio for _, each in found if math.isfinite(each.ratio)), default=math.nan):.2f}"
    pairs = [(each, np.isfinite(each.kept)) for _, each in found]
    cases = [
        each.kept[able & (each.case == case)].mean() for each, able in pairs for case in set(each.case[able].tolist())
    ]
    yield f"{np.mean(cases):.1%} of {len(cases)}"


def main(arguments: Sequence[str]) -> None:
    """Measure, print and write the table."""
    cases = int(arguments[0]) if arguments else CASES
    numbers = range(int(arguments[1]) if arguments[1:] else CAMPAIGNS)
    verdicts = []
    with ProcessPoolExecutor(2, get_context("spawn")) as pool:
        for number, each in enumerate(pool.map(partial(judge, most_cases=cases), numbers)):
            print(f"campaign {number}: {each.campaign.kind}", file=sys.stderr, flush=True)
            verdicts.append(each)
    show(table(verdicts), Path(__file__).with_suffix(".csv"))


if __name__ == "__main__":
    main(sys.argv[1:])
