"""Commands that show results: report, figure, show, try, frames, profile, effects, explain."""

import itertools
import math
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, Final, NamedTuple

import click
import xarray as xr

from nanoslip.solver.case import Case, make_image
from nanoslip.solver.contact.pin import roughness_slopes
from nanoslip.solver.ensemble import FEWEST
from nanoslip.solver.outcome import UNDONE, Ending, InvalidInput
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.validity import MISSED, MISSING, resolving_nodes
from nanoslip.study import api
from nanoslip.study.accuracy.deciding import SECONDS
from nanoslip.study.accuracy.effects import (
    Influence,
    Scenes,
    comparison_seconds,
    find_verdict,
    influences,
    measure_time,
    select_scenes,
)
from nanoslip.study.accuracy.spending import LENGTHS, Sample, Spending, probe_lengths, spending
from nanoslip.study.commands.answering import friction_answer, ranking
from nanoslip.study.commands.datasets import assignments, choose_case, find_dataset, has_manifest, single
from nanoslip.study.commands.plans import BALL, drive_lines, plural, refusals
from nanoslip.study.commands.words import Refusal
from nanoslip.study.dataset import file, variables
from nanoslip.study.dataset.units import is_given_in_si, read_scales
from nanoslip.study.dataset.variables import DRIVE_NAME
from nanoslip.study.exit_codes import FAILURES
from nanoslip.study.manifest.cases import CampaignCase, expand, make_campaign
from nanoslip.study.manifest.checker import number_or_text
from nanoslip.study.manifest.manifest import Manifest, drive_parameters, drive_sizes
from nanoslip.study.manifest.parameters import STANDARD, has_unit, make_case, names_by_word, resembles_ball, si_line
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.expectations import beyond_step_limit, out_of_reach
from nanoslip.study.plan.plan import make_partial_plan, make_plan
from nanoslip.study.report import single_case, summary
from nanoslip.study.report.budget import error_lines
from nanoslip.study.report.console import FAILED, Table, note, print_sentences, print_table
from nanoslip.study.report.curves import curves, inertial_range, print_lines
from nanoslip.study.results.files import results_folder, shard_folders
from nanoslip.study.run.journal import read_task_times
from nanoslip.study.run.progress import roughly
from nanoslip.study.tasks.estimates import condensation_seconds, record_seconds, touch_seconds
from nanoslip.study.tasks.task import idle


def show_dataset(campaign: Path, parameters: tuple[str, ...], out: Path | None, picture: Path | None) -> None:
    """Print the case of a campaign that has these parameters, or draw it."""
    selection = assignments(parameters)
    if picture:
        _draw().shared.file_format(picture)
    with find_dataset(campaign, out) as dataset:
        note(dataset.attrs.get("title", "no title"))
        _show_case(single(dataset, selection), dataset, picture)


# `nanoslip try`: one case from the command line, computed at once; nothing stays on disk.


def try_campaign(
    parameters: tuple[str, ...],
    contact: bool,
    drive: bool,
    critical: bool,
    stroke: str | None,
    everything: bool,
    picture: Path | None,
) -> None:
    """Compute one case in this process and print its answer, or draw it.

    stroke: of a path to and fro, end to end. everything: print all numbers and lines.
    """
    if contact and (drive or critical):
        raise click.UsageError("--contact and --drive exclude each other, --critical is of a drive")
    typed = assignments(parameters)
    if stroke:
        typed |= _path_keys(stroke)
    if picture:
        # What cannot be drawn is better known before it is computed.
        _draw().shared.file_format(picture)
    with refusals(MemoryError), _naming_keys_as_typed():
        search = {"critical": "true"} if critical else {}
        content = make_campaign(typed | search, contact, drive or critical)
        stated = api.read_campaign(content).fixed.keys()
        print_sentences(_choose_quick_grid(content), stderr=True)
        manifest = api.read_campaign(content)
        print_sentences(drive_lines(manifest), stderr=True)
        _refuse_endless_drive(manifest)
        print_sentences(_drive_outlook(manifest), stderr=True)
        compute = partial(api.run, content, progress=True)
        dataset, seconds = measure_time(compute)
    outcomes = [outcome for outcome in variables.OUTCOMES.values() if outcome.ending.name in dataset]
    endings = {}
    for outcome in outcomes:
        ending = dataset[outcome.ending.name].item()
        endings[ending] = dataset[outcome.message.name].item()
    if Ending.INVALID in endings:
        raise Refusal(endings[Ending.INVALID])
    print_sentences(_idle(typed, contact))
    if resembles_ball(typed):
        note(BALL)
    case = single(dataset, {})
    case_rate = seconds / sum(task.cost for task in make_plan(manifest).tasks)
    answer = friction_answer(case, manifest, expand(manifest)[0], stated, None, case_rate)
    for line in answer:
        note(line)
    last = "path" if "loss_per_cycle" in case else manifest.stages[-1]
    _show_case(case, dataset, picture, () if everything else BRIEF[last], answered=True)
    # Once more, as the first one has scrolled away.
    for line in answer:
        note(line)
    if endings.keys() & UNDONE:
        sys.exit(FAILURES)


def _drive_outlook(manifest: Manifest) -> Iterator[str]:
    """Report why a drive may have no answer: to be known before minutes are spent on it."""
    # A case that is refused says why by itself.
    with suppress(InvalidInput):
        plan = make_plan(manifest)
        for line in out_of_reach(plan).values():
            yield f"expected: {line}"


def _refuse_endless_drive(manifest: Manifest) -> None:
    """Raise Refusal for a drive that would be computed up to its step_limit in vain."""
    with suppress(InvalidInput):
        if line := beyond_step_limit(make_plan(manifest)):
            raise Refusal(f"{line}; without a drive there is friction alone")


def _path_keys(stroke: str) -> dict[str, str]:
    """Key of [path] and value for a stroke, end to end: a length with a unit, or in presliding lengths. Raises Refusal."""
    if has_unit(stroke):
        return {"stroke": stroke}
    try:
        return {"amplitude": str(float(stroke) / 2.0)}
    except ValueError:
        raise Refusal(f'--stroke {stroke}: needs presliding lengths, or a length as "2 mm"') from None


PATIENCE: Final = 15.0
"""Estimated core seconds that a reader waits for a case whose n_x is not given."""
PROBING: Final = 0.2
"""Share of PATIENCE that a probe on few nodes may take, as estimated."""
_DECIDED: Final = ("ensemble", "limits", "path")
"""Tables of a campaign whose author decides about members and lengths."""


class _Choice(NamedTuple):
    """The content of a campaign with one grid, its estimated core seconds and bytes, and the choice of members and length."""

    content: dict[str, Any]
    seconds: float
    memory: float
    spending: Spending | None

    @property
    def cost(self) -> str:
        """Time, and memory from a gigabyte on, in words."""
        memory = f" and {self.memory / 1e9:.1f} GB" if self.memory >= 1e9 else ""
        return f"{roughly(self.seconds)}{memory}"


def _choose_quick_grid(content: dict[str, Any]) -> Iterator[str]:
    """Give a case without n_x the finest grid, up to the default, that takes at most PATIENCE; report the costs of finer ones.

    Where that takes longer than PATIENCE and the case slides, members and lengths that nobody gave are chosen by a probe
    (`spending`). A given n_x stays; its cost is reported if it is longer.
    """
    stated = content.get("numerics", {}).get("n_x")
    spaces = (stated or Slab().n_x) - 1
    # Halves of the spacing: their nodes lie on those of the finest grid, and the change from one to the next is of one kind.
    grids = [spaces // part + 1 for part in (1, 2, 4, 8)]
    usual = _choice(content, grids[0])
    if usual.seconds <= PATIENCE:
        return
    decided = content.keys() & {*_DECIDED} or "slip" not in content["stages"]
    samples = [] if decided else _probe_grids(content, grids)
    considered = grids[:1] if stated else grids
    choices = {n_x: _choice(content, n_x, samples) for n_x in considered}
    quick = [n_x for n_x, choice in choices.items() if choice.seconds <= PATIENCE]
    n_x = quick[0] if quick else grids[0]
    chosen = choices[n_x]
    if stated or quick:
        content |= chosen.content
    longer = [f"n_x = {finer} takes {choices[finer].cost}" for finer in reversed(choices) if finer > n_x]
    # Where no grid is quick, fewer nodes do not help: the usual grid stays.
    if not quick:
        yield f"estimated time: {chosen.cost}"
    elif longer:
        yield f"n_x = {n_x}, for an answer in seconds; {', '.join(longer)}"
    if not chosen.spending:
        return
    yield _spending_sentence(chosen.spending, samples)
    half = 2 * (n_x - 1) + 1
    if half not in choices:
        # Half the spacing may be beyond the largest grid of its scheme.
        with suppress(ManifestError):
            yield f"half the node spacing, n_x = {half}, takes {_choice(content, half, samples).cost}"


def _spending_sentence(spending: Spending, samples: Sequence[tuple[Sample, Sample]]) -> str:
    """Members and lengths that were chosen, and what these and the node spacing change."""
    records = f"{spending.members} starts of {spending.presliding:g} presliding lengths"
    error = f"their ± is about {100.0 * spending.error:.1g} % of friction"
    change = f"half the node spacing changes it by about {100.0 * spending.change:.1g} %"
    finest, _ = samples[0]
    return f"{records}: {error}, and {change} (estimated on n_x = {finest.n_x})"


def _choice(content: dict[str, Any], n_x: int, samples: Sequence[tuple[Sample, Sample]] = ()) -> _Choice:
    """A grid, and members and lengths of records if samples tell which are enough."""
    on_grid = _set_grid(content, n_x)
    chosen = spending(samples, n_x)
    if chosen:
        ensemble = {"members": chosen.members}
        on_grid |= {"ensemble": ensemble, "limits": {"presliding": chosen.presliding}}
    tasks = make_plan(api.read_campaign(on_grid)).tasks
    seconds = sum(task.cost for task in tasks)
    if chosen:
        finest, _ = samples[-1]
        # A probe that took longer than estimated tells what the estimate misses of each length.
        seconds += max(finest.excess, 0.0) * chosen.members * chosen.presliding
    memory = max((task.memory for task in tasks), default=0.0)
    return _Choice(on_grid, seconds, memory, chosen)


def _set_grid(content: dict[str, Any], n_x: int) -> dict[str, Any]:
    """The content of a campaign on this grid."""
    numerics = {**content.get("numerics", {}), "n_x": n_x}
    return content | {"numerics": numerics}


def _probe_grids(content: dict[str, Any], grids: Sequence[int]) -> list[tuple[Sample, Sample]]:
    """Samples on the finest of these grids that is quick enough for a probe, and on the next coarser one; none if none is."""

    def read_probe(n_x: int, presliding: float) -> Manifest:
        short = {"ensemble": {"members": FEWEST}, "limits": {"presliding": presliding}}
        return api.read_campaign(_set_grid(content | short, n_x))

    for fine, coarse in itertools.pairwise(grids):
        plan = make_plan(read_probe(fine, LENGTHS[0]))
        if sum(task.cost for task in plan.tasks) <= PROBING * PATIENCE:
            # A scheme may not take the coarser grid.
            with suppress(ManifestError):
                return list(probe_lengths(read_probe, (fine, coarse)))
    return []


def _idle(words: Mapping[str, str], contact: bool) -> Iterator[str]:
    """The parameters that were given and change nothing, as in campaigns, each with the reason."""
    names = names_by_word()
    texts = {names[key]: words[key] for key in words if key in names}
    values = {name: number_or_text(text) for name, text in texts.items()}
    # A case that is refused says why by itself.
    with suppress(InvalidInput):
        yield from idle([make_case(values)], values.keys(), contact)


@contextmanager
def _naming_keys_as_typed() -> Iterator[None]:
    """Name keys in problems as they were typed: without a file, and the tables that a campaign has them in."""
    try:
        yield
    except ManifestError as error:
        raise error.drop_places() from None


# `nanoslip effects`: what a campaign's numbers lose without each of its effects, and the time that this saves.

_HEADER = ("effect", "number", "change ±", "seconds ×", "setting")


def show_effects(campaign: Path, cases: int, members: int | None) -> None:
    """Compute a few cases with everything and without each effect, and print the changes."""
    manifest = load_manifest(campaign)
    scenes = select_scenes(manifest, list(expand(manifest)), cases, members)
    print_changes(campaign, scenes)


def print_changes(campaign: Path, scenes: Scenes) -> None:
    """Compute these scenes with everything and without each effect, and print the changes."""
    size = f"{plural(len(scenes.cases), 'case')}, {plural(scenes.ensemble.members, 'member')} each"
    time = roughly(comparison_seconds(scenes))
    note(f"{campaign}: computing {size}, with everything and without one effect at a time, {time} in all", stderr=True)
    changes, failures = influences(scenes)
    stated = scenes.manifest.stated_scales
    labels = (summary.label_text(case.parameters, stated) for case in scenes.cases)
    print_sentences(f"case {number}: {label}" for number, label in enumerate(labels, start=1))
    print_sentences((f"with everything, {failure}" for failure in failures), FAILED)
    if not changes:
        note("nothing to compare: no number of these cases depends on an effect that can be left out")
        return
    print_sentences(_verdict(changes, scenes.manifest.ensemble.within or 0.0))
    failed = frozenset(number for number, influence in enumerate(changes) if influence.problems)
    rows = tuple(map(_row, changes))
    print_table(Table(_HEADER, rows, labels=2, asked=2, failed=failed))
    note(
        "change: mean over the cases, with ±. Below each effect: what leaves it out, and the range of the cases' changes, "
        "noise included. seconds ×: without it, over everything"
    )


def _verdict(changes: Sequence[Influence], tolerance: float) -> Iterator[str]:
    """Effects that a number needs, does not need, and of which it is not known, each in a sentence."""
    verdict = find_verdict(changes, tolerance)
    needed, negligible, unknown = map(", ".join, verdict)
    within = "beyond 2 ± ([target] within asks for less)"
    small = "not seen"
    if tolerance:
        within = f"within {tolerance:.2g} ([target] within)"
        small = "not needed"
    if needed:
        yield f"needed, {within}: {needed}"
    if negligible:
        yield f"{small}, {within}: {negligible}"
    if unknown:
        yield f"not known, {within}: {unknown}; more --members tell"


def _row(influence: Influence) -> tuple[str, ...]:
    least, most = influence.changes[0], influence.changes[-1]
    change = seconds = "–"
    if math.isfinite(influence.change):
        change = f"{influence.change:+.2g} ± {_share(influence.uncertainty)}"
        seconds = f"{influence.seconds:.2g}"
        if least.change == most.change == 0.0:
            change = "0"
    sentences = [influence.setting]
    if least.change < most.change:
        sentences.append(f"{least.change:+.2g} in case {least.where} to {most.change:+.2g} in case {most.where}")
    sentences += influence.problems[:1]
    return influence.effect, influence.variable, change, seconds, "; ".join(sentences)


def _share(uncertainty: float, digits: str = ".1g") -> str:
    """Word the ± of a relative change; ? if a member lacks the number."""
    return f"{uncertainty:{digits}}" if math.isfinite(uncertainty) else "?"


# `nanoslip explain`: the estimated time of a case, and what decides its main number once it is computed.


def explain_case(
    campaign: Path, parameters: tuple[str, ...], out: Path | None, show_grid: bool, show_effects: bool
) -> None:
    """Print cost and errors of the case with these parameters, and, if requested, the changes by grid and effects."""
    manifest = load_manifest(campaign)
    of_drives = {*drive_parameters(), DRIVE_NAME.name}
    # A case is looked for by its own parameters: those of its drives are for the numbers that are shown.
    words = assignments(parameters)
    selection = {key: value for key, value in words.items() if key not in of_drives}
    case = choose_case(manifest, expand(manifest), selection)
    if case.case is None:
        raise Refusal(f"{case.point}: {case.outcome.message}")
    into = results_folder(campaign, out)
    measured = read_task_times(into, *shard_folders(into))
    tasks = make_partial_plan(manifest, [case]).tasks
    seconds = sum(map(measured.seconds, tasks))
    label = summary.label_text(case.parameters, manifest.stated_scales)
    roughness = _roughness_lines(case.case, "slip" in manifest.stages)
    print_sentences([f"case {label}", f"estimated time of its computation: {roughly(seconds)}", roughness])
    scenes = select_scenes(manifest, [case], SHOWN)
    # Four times the members halve the ±.
    cost = roughly(4.0 * seconds)
    most = math.inf if show_grid else SECONDS
    _explain(into / file.FILE, manifest, parameters, case, cost, most)
    if show_effects:
        print_changes(campaign, scenes)


def _explain(
    path: Path, manifest: Manifest, parameters: tuple[str, ...], of: CampaignCase, cost: str, most: float
) -> None:
    """Print the errors of a computed case's main number, the largest first, and the errors of its other numbers."""
    if path.is_file():
        with file.reading(path) as dataset:
            if has_manifest(dataset, manifest):
                case = single(dataset, assignments(parameters))
                ranked = ranking(case, manifest, of, cost, most, path.parent)
                if ranked:
                    note(f"what decides {ranked.title}, the largest first:")
                    print_table(ranked.table)
                apart = (ranked.variable,) if ranked else ()
                print_sentences(error_lines(case, cost, SHOWN, apart))
                return
    note("not computed yet: afterwards explain ranks what decides its main number")


SHOWN: Final = 3
"""Drives whose effects are shown: the first, the middle and the last one."""


def _roughness_lines(case: Case, slides: bool) -> str:
    """Report the roughness that nodes miss, its effect on plateaus, and the grid that resolves it; empty for a smooth pin."""
    image = make_image(case.heterogeneity.roughness)
    slope, missed = roughness_slopes(image, case.slab.spacing)
    if not slope:
        return ""
    sentence = f"roughness: nodes miss {missed / slope:.0%} of its slope; plateaus are {MISSING}"
    nodes = resolving_nodes(image)
    if missed <= MISSED * slope or not nodes:
        return sentence
    finer = replace(case, slab=replace(case.slab, n_x=nodes))
    ratio = _seconds(finer, slides) / _seconds(case, slides)
    return f"{sentence}; n_x = {nodes} resolves it, in {ratio:.2g} × the time of this grid"


def _seconds(case: Case, slides: bool) -> float:
    rest = record_seconds(case) if slides else touch_seconds(case)
    return condensation_seconds(case.slab) + rest


# One case of a dataset on the terminal: how it ended, its numbers, its lines in text; or its lines as a picture.

_NAMES: Final = ("case_id", "case")
"""Coordinates that are no parameters."""


BRIEF: Final[Mapping[str, tuple[str, ...]]] = {
    "contact": ("contact_half_width", "approach", "mean_pressure", "maximum_pressure", "initial_stiffness"),
    "slip": ("plateau_mean", "peak_friction", "surface_stiffness", "contact_half_width", "events", "record_spacings"),
    "path": (
        "cycle_stroke",
        "loss_per_cycle",
        "turn_friction",
        "equivalent_damping",
        "closure",
        "shaken_down",
        "contact_half_width",
    ),
    "dynamics": (
        "static_friction",
        "kinetic_friction",
        "regime",
        "critical_velocity",
        "loop_energy",
        "contact_energy",
        "damper_energy",
        "midstroke_friction",
        "turn_static_friction",
        "leg_regime",
        "pin_stroke",
        "sliding_stroke",
        "stage_closure",
        "stick_slip_period",
        "spring_force_amplitude",
        "surface_stiffness",
        "contact_half_width",
        "record_spacings",
    ),
}
"""Last stage, or a path -> the numbers that its question calls for."""


def _show_case(
    case: xr.Dataset, dataset: xr.Dataset, picture: Path | None, names: Collection[str] = (), answered: bool = False
) -> None:
    """Print a case of a dataset, or write its picture besides.

    names: only these numbers, and the last line. answered: the caller prints the answer, and why the case failed.
    """
    _print_numbers(case, dataset, names, answered)
    # The brief answer has room for one line: that of the last stage.
    lines = list(curves(case))[-1 if names else 0 :]
    if lines and variables.are_means(case):
        note("lines are those of the first member")
    if picture:
        content = _draw().draw_lines(lines, picture)
        _draw().write_and_note({picture: content})
    else:
        print_lines(lines)
    inertial = inertial_range(case)
    if inertial:
        least, most, holds = inertial
        alone = f"{least:.3g} to {most:.3g}, is not friction alone: the contact holds {holds:.3g}"
        # The advice of a pin that does not slip is to pull harder: this one would contradict it.
        stuck = Ending.NO_SLIP.value == case["drive_outcome"].item()
        advice = "" if stuck else "; lower stage_velocity, spring_stiffness or pin_mass"
        note(f"the spring force over load, {alone}, the rest is inertia and damper{advice}")
    # Once more, as the answer has scrolled away.
    if lines and not answered:
        note(single_case.answer(case))


def _print_numbers(case: xr.Dataset, dataset: xr.Dataset, names: Collection[str], answered: bool) -> None:
    """Print parameters, outcome and numbers of a case, all or only these; several drives as rows."""
    scalars = [coordinate for coordinate in case.coords.values() if not coordinate.dims]
    values = {str(coordinate.name): coordinate.item() for coordinate in scalars}
    scales = read_scales(dataset.attrs)
    sentences = [f"case {_label(case, dataset)}"]
    if scales:
        sentences.append(f"in SI: {si_line(scales, values, {})}")
    of_drive = drive_parameters().keys() & values.keys()
    sizes = drive_sizes({name: (values[name],) for name in of_drive})
    if sizes:
        sentences.append(f"drive: {', '.join(sizes)}")
    outcomes = single_case.ending_lines(case, brief=answered, names=names)
    print_sentences([*sentences, *outcomes])
    table, others = single_case.case_table(case, names)
    if table.rows:
        print_table(table)
    print_sentences(f"{reason}: {', '.join(lacking)}" for reason, lacking in others.items())
    if "drive_outcome" in case and case["drive_outcome"].dims:
        note("several drives; drive=NAME, or values of their parameters, shows one:")
        print_table(summary.scalar_table(case, why=False))
        print_sentences(summary.failure_summary(case).values(), FAILED)


def _label(case: xr.Dataset, dataset: xr.Dataset) -> str:
    """Parameters that distinguish a case from the dataset's others; the standard ones always."""
    # Sizes in SI have a line of their own.
    sizes = {coordinate.name for coordinate in variables.si_coordinates().values()}
    names = [str(name) for name in case.coords if not case[name].dims]
    parameters = [name for name in names if name not in _NAMES and name not in sizes]
    shown = [name for name in parameters if name in STANDARD or _varies(dataset[name])]
    # A punch has no radius: its half-width stands there.
    if "pin" in case and case["pin"].item() == "flat_punch":
        others = [name for name in shown if name not in ("pin", "half_width")]
        shown = ["pin", *("half_width" if name == "radius" else name for name in others)]
    scales = read_scales(dataset.attrs) if is_given_in_si(dataset) else None
    known_names = [name for name in shown if not case[name].isnull()]
    values = {name: case[name].item() for name in known_names}
    return summary.label_text(values, scales)


def _varies(coordinate: xr.DataArray) -> bool:
    """True if cases of a dataset differ in a coordinate."""
    return len(set(coordinate.values.ravel().tolist())) > 1


def _draw() -> Any:
    """The module that draws: matplotlib takes longer to load than a case to compute."""
    return import_module("nanoslip.study.commands.draw")
