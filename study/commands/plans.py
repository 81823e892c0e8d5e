"""A campaign's plan, printed by `plan`, `status` and `run`."""

import json
import math
import shlex
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any, Final

import click

from nanoslip.solver.outcome import InvalidInput, Outcome
from nanoslip.study.commands.words import Refusal
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import resembles_ball
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.origin import Origins, census, here
from nanoslip.study.plan.plan import KindCount, Plan, kind_counts, make_plan
from nanoslip.study.report.console import counting, note, whole
from nanoslip.study.results.attempts import Attempt
from nanoslip.study.results.entry import Meta
from nanoslip.study.results.files import results_folder, shard_folders
from nanoslip.study.results.store import Store, StoreError
from nanoslip.study.run.campaign import tasks_to_do
from nanoslip.study.run.dispatch import MeasuredTimes
from nanoslip.study.run.journal import read_task_times
from nanoslip.study.tasks.kind import KINDS
from nanoslip.study.tasks.task import Task, idle
from nanoslip.study.toml_text import from_toml

# Output for scripts: one JSON document instead of text. The keys are in docs/commands.md.


def print_json(value: Any) -> None:
    """Print a value as JSON, keys in their order; numbers that are not finite are null."""
    plain = _finite(value)
    # allow_nan refuses what _finite has missed: NaN is no JSON.
    text = json.dumps(plain, ensure_ascii=False, indent=1, allow_nan=False, default=_plain)
    click.echo(text)


def _finite(value: Any) -> Any:
    if isinstance(value, KindCount):
        value = asdict(value)
    if isinstance(value, Mapping):
        entries = value.items()
        return {str(key): _finite(entry) for key, entry in entries}
    if isinstance(value, list | tuple):
        return [_finite(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def _plain(value: Any) -> Any:
    return value.item() if hasattr(value, "item") else str(value)


# Errors that the user can correct, as messages of the command line.


@contextmanager
def refusals(*more: type[Exception]) -> Iterator[None]:
    """Turn errors of input, of manifests, of files of results and of given types into a `Refusal`."""
    kinds: tuple[type[Exception], ...] = (InvalidInput, ManifestError, StoreError, *more)
    try:
        yield
    except kinds as error:
        raise Refusal(str(error)) from error


def plan_campaign(campaign: Path) -> Plan:
    """The plan of a campaign file. Raises ManifestError."""
    manifest = load_manifest(campaign)
    tasks = manifest.case_count * _tasks_of_case(manifest)
    if tasks >= MANY:
        need = f"about {tasks * PLANNING:.0f} s and {tasks * PLANNED / 1e9:.2g} GB of memory"
        note(f"{whole(campaign)}: {manifest.case_count} cases, {tasks} tasks: planning takes {need}", stderr=True)
    with counting("{} cases planned") as count:
        return make_plan(manifest, count)


def _tasks_of_case(manifest: Manifest) -> int:
    """Number of tasks of a case, without tasks that cases share."""
    kinds = [kind for kind in KINDS.values() if kind.parts and kind.needed(manifest)]
    return sum(len(manifest.drives) if kind.driven else 1 for kind in kinds)


def load_own_numbers(manifest: Manifest) -> None:
    """Execute the files of a campaign's own numbers, before it is computed. Raises ManifestError.

    Only commands that compute do this; commands that read results never import these files.
    """
    if manifest.observables:
        # By name, as few campaigns have numbers of their own. A wrong name is refused before a file
        # is executed.
        import_module("nanoslip.study.dataset.variables").refuse_taken_names(manifest)
        import_module("nanoslip.study.tasks.functions").load_all(manifest)


MANY: Final = 200_000
"""Tasks from which the cost of planning is stated before it begins: planning takes more than ten seconds."""
PLANNING: Final = 62e-6
PLANNED: Final = 1800.0
"""Seconds, and bytes of memory, that a task takes to plan: a million records, each a case, had 1.8 GB; tests/benchmarks/README.md
has 1.2 GB of cases that keep scalars only."""


MASS: Final = "pin_mass"


def idle_lines(plan: Plan) -> list[str]:
    """The parameters and drives of a campaign that change nothing in any of its cases, each with the reason; limits of contacts
    aside. And `drive_lines`."""
    manifest = plan.manifest
    limits = {*manifest.tables["limits"]}
    stated = {*manifest.axes, *manifest.fixed} - limits
    cases = [case.case for case in plan.cases if case.case is not None]
    lines = idle(cases, stated, manifest.stages == ("contact",))
    return [*lines, *drive_lines(manifest)]


def drive_lines(manifest: Manifest) -> Iterator[str]:
    """Drives without a stage or without the critical velocity that is asked for, and the default mass of a drive in own units."""
    if manifest.drives_left_out:
        yield f'drives left out, as stages leave out "dynamics": {", ".join(manifest.drives_left_out)}'
    pulls = [drive for drive in manifest.drives if drive.drive]
    strokes = [drive.name for drive in pulls if drive.drive and drive.drive.in_si.stage_stroke is not None]
    if manifest.outputs.critical and strokes:
        names = ", ".join(dict.fromkeys(strokes))
        yield f"no critical velocity, which is that of a stage that goes one way, of drives to and fro: {names}"
    heavy = [drive for drive in pulls if MASS not in drive.given]
    if manifest.stated_scales and heavy and heavy[0].drive:
        names = ", ".join(dict.fromkeys(drive.name for drive in heavy))
        yield f"pin_mass = {heavy[0].drive.pin_mass:g} kg by default, of a laboratory's pin: {names}"


BALL: Final = (
    'radius is a length, no slab_depth: plane strain computes a cylinder; scheme = "half_space" computes a ball, '
    '"layer" one on a slab of this height'
)
"""Advice where the keys of a case resemble a ball."""


def ball_lines(plan: Plan) -> list[str]:
    """Advice if a campaign computes a cylinder where its keys resemble a ball."""
    top = from_toml(plan.manifest.text)
    table_values: dict[str, Any] = {}
    for name in ("scales", "constants", "numerics", "axes"):
        table = top.get(name, {})
        if isinstance(table, dict):
            table_values |= table
    return [BALL] if resembles_ball(table_values) else []


@dataclass(frozen=True, slots=True)
class Standing:
    """A campaign's plan and its progress: finished, failed and remaining tasks."""

    campaign: Path
    into: Path
    """Folder of the results."""
    plan: Plan
    stores: tuple[Store, ...]
    """Stores of the campaign itself, and of shards that are not merged."""
    kinds: Mapping[str, KindCount]
    """Kind of task -> count and costs, in the order of stages."""
    remaining: tuple[Task, ...]
    """Tasks that the next run would try."""
    given_up: tuple[Task, ...]
    """Tasks that it would not compute: failed tasks, and tasks that need a failed task."""
    foreign: Mapping[str, Origins]
    """Finished results of other software."""
    measured: MeasuredTimes
    """Measured times of tasks, which scale the seconds left of `kinds`."""
    outcomes: Mapping[str, Outcome]
    """Key of each task that has ended -> how."""


def standing(
    campaign: Path,
    out: Path | None,
    measure: Callable[[Plan], MeasuredTimes] | None = None,
    *,
    sized: bool = False,
) -> Standing:
    """Progress of a campaign. Raises ManifestError.

    out: folder of the results, None for the campaign's own. measure: times of tasks; None: from the journals there.
    sized: whether bytes of all tasks are estimated.
    """
    into, plan = results_folder(campaign, out), plan_campaign(campaign)
    folders = (into, *shard_folders(into))
    stores = tuple(Store(folder, whole=False) for folder in folders)
    metas: dict[str, Meta] = {}
    failures: dict[str, Attempt] = {}
    for store in stores:
        metas |= store.metas()
        failures |= store.failures()
    origins = {key: meta.origins for key, meta in metas.items()}
    # Of all folders together: a shard that is not merged yet counts as done.
    rest = tasks_to_do(plan, failures, origins)
    measured = measure(plan) if measure else read_task_times(*folders)
    tasks = plan.tasks if sized else plan.distinct
    counts = kind_counts(tasks, rest.tasks, rest.given_up)
    kinds = {}
    for kind, count in counts.items():
        seconds = measured.factor(kind) * count.core_seconds_left
        kinds[kind] = replace(count, core_seconds_left=seconds)
    finished = {key: meta.outcome for key, meta in metas.items()}
    failed = {key: attempt.outcome for key, attempt in failures.items()}
    return Standing(
        campaign=campaign,
        into=into,
        plan=plan,
        stores=stores,
        kinds=kinds,
        remaining=rest.tasks,
        given_up=rest.given_up,
        foreign=rest.foreign,
        measured=measured,
        outcomes=plan.outcomes(finished, failed),
    )


def command_text(command: str, campaign: Path, into: Path, *options: str) -> str:
    """A command on a campaign, for advice: ready to be typed, with the folder of results if it is not the campaign's
    default."""
    is_default = into == results_folder(campaign, None)
    out = () if is_default else ("--out", str(into))
    return whole(f"nanoslip {shlex.join([command, str(campaign), *out, *options])}")


def print_foreign(foreign: Mapping[str, Origins], campaign: Path, into: Path, stderr: bool = False) -> None:
    """Print which finished results are by other software, and how to compute them again; nothing where none are."""
    if not foreign:
        return
    counts = sorted(census(foreign.values()).items())
    parts = "; ".join(f"{count} of {origin}" for origin, count in counts)
    again = command_text("run", campaign, into, "--recompute-foreign")
    sentence = f"{len(foreign)} finished results are other software's: {parts}; here is {here()}"
    note(f"{sentence}. They are used as they are; {again} computes them again", stderr=stderr)


def plural(number: int, what: str) -> str:
    """A number of things in words: `1 case`, `2 cases`."""
    return f"{number} {what}{'' if number == 1 else 's'}"
