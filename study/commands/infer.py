"""Commands that infer: parameters that matter (sensitivity), that agree with numbers (fit), and numbers of a force (trace)."""

import itertools
import json
import re
from collections.abc import Collection, Mapping, Sequence
from contextlib import nullcontext
from functools import partial
from pathlib import Path
from typing import Any, Final

import click

from nanoslip.solver.case import parameters_of_a_case
from nanoslip.solver.drive import Scales
from nanoslip.study.commands.datasets import find_dataset
from nanoslip.study.commands.plans import plural, print_json, refusals
from nanoslip.study.commands.words import Refusal, show
from nanoslip.study.dataset.units import format_value, with_size
from nanoslip.study.dataset.variables import find_variables, variables_by_name
from nanoslip.study.exit_codes import INTERRUPTED
from nanoslip.study.figures.shared import file_format, image
from nanoslip.study.inference.campaign import Ends, Question, join_plans, make_question
from nanoslip.study.inference.fit import LEVELS, Fit, Target, filling, sentences
from nanoslip.study.inference.pictures import bars, contours
from nanoslip.study.inference.sensitivity import caution, sensitivity
from nanoslip.study.manifest.checker import number_or_text, read_text
from nanoslip.study.manifest.manifest import Manifest, drive_parameters
from nanoslip.study.manifest.parameters import word_for_symbol
from nanoslip.study.manifest.problems import suggestion_remark
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.expectations import out_of_reach
from nanoslip.study.plan.plan import Plan
from nanoslip.study.report.console import Table, console, note, print_sentences, print_table, whole
from nanoslip.study.report.summary import failure_summary, flag_summary
from nanoslip.study.results.files import results_folder
from nanoslip.study.results.store import Lease, Store, write_files
from nanoslip.study.run.campaign import Rest, ShortageError, UnfinishedError, compute_campaign
from nanoslip.study.run.child import FarmError
from nanoslip.study.run.dispatch import Watch
from nanoslip.study.run.farm import Farm, open_farm
from nanoslip.study.run.journal import Journal, read_task_times
from nanoslip.study.run.launch import task_program
from nanoslip.study.run.progress import makespan, open_progress, roughly
from nanoslip.study.tasks.drive import reciprocates

# `nanoslip sensitivity`: which parameters a number depends on, from the cases of a dataset.


def show_sensitivity(dataset: Path, of: str, out: Path | None, picture: Path | None, as_json: bool) -> None:
    """Print the first-order and total indices of a number, or draw them."""
    form = file_format(picture) if picture else ""
    with refusals(ValueError), find_dataset(dataset, out) as opened:
        answer = sensitivity(opened, of)
        failures = failure_summary(opened).values() if answer.holes else ()
        flags = flag_summary(opened).values()
    columns = (answer.axes, answer.first.tolist(), answer.total.tolist())
    shares = list(zip(*columns, strict=True))
    if as_json:
        axes = {axis: {"first": first, "total": total} for axis, first, total in shares}
        parts = {"noise": answer.noise, "scatter": answer.scatter, "note": caution(answer)}
        print_json({"of": answer.of, "axes": axes, **parts})
        return
    if not answer.unknown:
        shares.sort(key=_total_share, reverse=True)
        rows = tuple((axis, *_shares(first), *_shares(total), "") for axis, first, total in shares)
        header = ("parameter", "alone", "95 %", "in all", "95 %", "")
        print_table(Table(header, rows))
    print_sentences([caution(answer), *failures, *flags])
    if picture and not answer.unknown:
        write_files({picture: image(bars(answer), form)})
        note(whole(f"written: {picture}"))


def _total_share(shares: tuple[str, Any, Any]) -> float:
    """The part of a parameter in all, without its interval."""
    _, _, (total, *_) = shares
    return float(total)


def _shares(values: Any) -> tuple[str, str]:
    middle, low, high = values
    return f"{middle:.3f}", f"{low:.2f} to {high:.2f}"


# `nanoslip fit`: which parameters agree with measured numbers.

_TARGET: Final = re.compile(r"([^=]+)=([^±]+?)\s*(?:±|\+/-|\+-)\s*(.+)")
"""`mu_s=0.3±0.01`; ± may be typed as +/- or +-."""


def fit_campaign(
    campaign: Path,
    numbers: tuple[str, ...],
    trace: Path | None,
    vary: tuple[str, ...],
    points: int,
    jobs: int | None,
    out: Path | None,
    picture: Path,
    as_json: bool,
) -> None:
    """Compute points until the parameters that agree with the numbers are determined; print and draw these. Ends the
    process."""
    form, into = file_format(picture), results_folder(campaign, out)
    # What may be mistyped is refused before anything is computed.
    targets, fixed = read_numbers(numbers)
    with refusals(ValueError):
        manifest = load_manifest(campaign)
    if trace:
        names_stated = {target.name for target in targets}
        loops = loop_targets(manifest)
        if loops:
            targets += read_loop_numbers(trace, loops, manifest, names_stated)
        else:
            targets += read_trace_numbers(trace, names_stated)
    if not targets:
        raise Refusal("needs a measured number with its ±, as mu_s=0.3±0.01")
    with refusals(ValueError, FarmError):
        question = make_question(manifest, targets, read_ranges(vary), fixed)
        question.check(into)
        farm = open_farm(task_program(into), jobs=jobs)
    with farm:
        # Under MPI all ranks but the first compute for it until they are told to leave.
        if not farm.root:
            farm.leave(farm.serve())
        try:
            with refusals(ValueError, ShortageError, FarmError):
                fit = _compute_fit(farm, question, into, points)
        except click.ClickException as error:
            show(error)
            farm.leave(INTERRUPTED if isinstance(error.__cause__, UnfinishedError) else error.exit_code)
        if as_json:
            print_json(_as_json(fit) | {"notes": list(sentences(fit))})
        else:
            _print(fit, question.manifest.scales)
            print_sentences(sentences(fit))
        best = campaign.with_name(f"{campaign.stem}_best.toml")
        drawn = image(contours(fit), form)
        text = question.at(fit.best)
        write_files({picture: drawn, best: text.encode()})
        note(f"{whole(f'written: {picture}')}; {whole(f'{best}')}, the best point as a campaign", stderr=as_json)
        farm.leave(0)


def read_numbers(words: Sequence[str]) -> tuple[list[Target], dict[str, Any]]:
    """Measured numbers, and values of parameters that do not vary, from words as `mu_s=0.3±0.01` and `radius=200`."""
    targets, fixed = [], dict[str, Any]()
    for word in words:
        key, sign, text = word.partition("=")
        measured = _TARGET.fullmatch(word)
        if measured:
            try:
                value, error = float(measured[2]), float(measured[3])
                target = Target(measured[1], value, error)
            except ValueError:
                raise Refusal(f"{word}: needs two numbers, as mu_s=0.3±0.01") from None
            targets.append(target)
        elif not (sign and key and text):
            raise Refusal(f"{word}: needs NUMBER=VALUE±ERROR, as mu_s=0.3±0.01, or KEY=VALUE, as radius=200")
        elif key != "drive" and word_for_symbol(key, _KEYS) not in _WORDS:
            is_number = bool(find_variables(list(variables_by_name()), key))
            remark = "" if is_number else suggestion_remark(key, _WORDS)
            measured_number = f"no parameter; a measured number needs its ±, as {key}=0.3±0.01 (or 0.3+-0.01)"
            raise Refusal(f"{word}: {remark or measured_number}")
        elif key in fixed:
            raise Refusal(f"{word}: {key} is given twice")
        else:
            fixed[key] = number_or_text(text)
    return targets, fixed


OF_TRACES: Final = {"static_friction": "mu_s", "kinetic_friction": "mu_k"}
"""Numbers of a trace that are fitted, and their keys. Period and amplitude belong to one spring, mass and velocity."""


STAGE_NUMBERS: Final = {"cycle_energy": "loop_energy", "mid_stroke_friction": "midstroke_friction"}
PATH_NUMBERS: Final = {
    "cycle_energy": "loss_per_cycle",
    "turn_friction": "turn_friction",
    "secant_stiffness": "secant_stiffness_si",
}
"""Numbers of measured loops that are fitted, and their names in a dataset: of a drive with a stroke, and of strokes of a path."""


def loop_targets(manifest: Manifest) -> Mapping[str, str]:
    """Measured numbers of loops that a campaign has, and their names in its dataset; none if it has no loops."""
    if reciprocates(manifest):
        return STAGE_NUMBERS
    values = (*manifest.case_values("amplitude"), *manifest.case_values("stroke"))
    is_cyclic = any(values)
    return PATH_NUMBERS if is_cyclic else {}


def read_trace_numbers(file: Path, stated: Collection[str] = ()) -> list[Target]:
    """Friction coefficients in the output of `nanoslip trace --json`, except those given directly. Raises Refusal."""
    needs = "needs what nanoslip trace FILE --load FORCE --json writes"
    measured = _read_trace_json(file, needs)
    # As of a computed drive.
    measured["kinetic_friction"] = measured.get("mean_force", measured.get("kinetic_friction"))
    targets = _make_targets(file, measured, {name: name for name in OF_TRACES}, needs)
    units = {measured[target.name].get("unit") for target in targets}
    if units != {"1"}:
        raise Refusal(f"{file}: {needs}, which has friction coefficients")
    of_keys = (name for name, key in OF_TRACES.items() if key in stated)
    names = {*stated, *of_keys}
    return _select_sure_targets(file, targets, names)


def read_loop_numbers(
    file: Path, names: Mapping[str, str], manifest: Manifest, stated: Collection[str] = ()
) -> list[Target]:
    """Numbers of loops in the output of `nanoslip trace --json`, except those given directly, as a dataset has them.

    names: measured name -> name in a dataset. Energies are in W·L_x there. Raises Refusal.
    """
    needs = "needs the loops that nanoslip trace FILE --load FORCE --json writes of a force over positions that turn"
    measured = _read_trace_json(file, needs)
    targets = _make_targets(file, measured, names, needs)
    if not any(target.name == names["cycle_energy"] for target in targets):
        raise Refusal(f"{file}: {needs}")
    scales = manifest.stated_scales
    if scales is None:
        raise Refusal(f"{manifest.path}: needs slab_width in [scales]: energies of loops are in J")
    # The energy of a force over load is per newton already.
    load = 1.0 if measured["cycle_energy"]["unit"] == "J N-1" else measured.get("load")
    if not load:
        raise Refusal(f"{file}: {needs}, and has no load")
    per = float(load) * scales.slab_width
    scaled = []
    for target in targets:
        factor = 1.0 / per if target.name == names["cycle_energy"] else 1.0
        value, error = factor * target.value, factor * target.error
        scaled.append(target._replace(value=value, error=error))
    return _select_sure_targets(file, scaled, stated)


def _read_trace_json(file: Path, needs: str) -> dict[str, Any]:
    try:
        content = json.loads(read_text(file))
    except json.JSONDecodeError:
        raise Refusal(f"{file}: {needs.replace('FILE', str(file))}, and is no JSON") from None
    if not isinstance(content, dict):
        raise Refusal(f"{file}: {needs}")
    return content


def _make_targets(file: Path, content: Mapping[str, Any], names: Mapping[str, str], needs: str) -> list[Target]:
    """Numbers of a trace by the names that they have in a dataset. Raises Refusal."""
    targets = []
    try:
        for measured, name in names.items():
            if number := content.get(measured):
                error = float(number["uncertainty"] or 0.0)
                value = float(number["value"])
                targets.append(Target(name, value, error, one_start=True))
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise Refusal(f"{file}: {needs} ({type(error).__name__}: {error})") from None
    return targets


def _select_sure_targets(file: Path, targets: Sequence[Target], stated: Collection[str]) -> list[Target]:
    """The numbers with ±, except those given directly."""
    unsure = [target.name for target in targets if not target.error > 0.0]
    if unsure:
        note(f"{file}: {', '.join(unsure)} without ± is left out; it may be given as mu_s=0.3±0.01")
    sure = [target for target in targets if target.error > 0.0]
    return [target for target in sure if target.name not in stated]


_KEYS: Final = {**parameters_of_a_case(), **drive_parameters()}
_WORDS: Final = frozenset(stated.word or name for name, stated in _KEYS.items())


def read_ranges(arguments: Sequence[str]) -> dict[str, Ends | None]:
    """Parameters that vary, and the ends of their ranges, from words as `mu_i=0.1:0.8,radius`."""
    ranges: dict[str, Ends | None] = {}
    words = itertools.chain.from_iterable(text.split(",") for text in arguments)
    for word in filter(None, words):
        key, sign, text = word.partition("=")
        low, colon, high = text.partition(":")
        if sign and not (low and colon and high):
            raise Refusal(f"--vary {word}: needs KEY=FROM:TO, as mu_i=0.1:0.8")
        if key in ranges:
            raise Refusal(f"--vary {word}: {key} is given twice")
        ranges[key] = (number_or_text(low), number_or_text(high)) if sign else None
    return ranges


def _compute_fit(farm: Farm, question: Question, out: Path, points: int) -> Fit:
    warn = partial(note, stderr=True)
    _announce_first_points(farm, question, out, points)

    def progress(rest: Rest, processes: int, measured: Any) -> Any:
        if not rest.tasks:
            return nullcontext(Watch())
        tasks = plural(len(rest.tasks), "task")
        warn(f"{question.manifest.title}: {tasks} of new points, {processes} {farm.unit}")
        return open_progress(rest.tasks, console(stderr=True), processes, measured)

    with Lease(out, farm.interruption.request) as lease:
        journal = Journal(out)

        def compute(plan: Plan) -> Store:
            return compute_campaign(farm, plan, journal, lease, progress, warn).store

        return question.answer(compute, out, points, failure_summary)


def _announce_first_points(farm: Farm, question: Question, out: Path, points: int) -> None:
    """Report tasks and time of the points that are computed first, and what none of them can reach."""
    plans = question.plans(filling(len(question.ranges))[:points])
    tasks = join_plans(plans).remaining(Store(out).inventory())
    if not tasks:
        return
    measured = read_task_times(out)
    time = ""
    # A time by estimates alone may be off by ten: it is reported once something has been measured.
    if measured.tasks({task.kind for task in tasks}):
        time = f", {roughly(makespan(tasks, farm.size, measured.seconds))}"
    first = f"{plural(len(tasks), 'task')} at first{time}"
    later = f"then more where it is open what agrees, at most {points} points"
    note(f"{question.manifest.title}: {first}; {later}", stderr=True)
    expected: dict[str, str] = {}
    for plan in plans:
        expected |= out_of_reach(plan)
    print_sentences(expected.values(), stderr=True)


def _print(fit: Fit, scales: Scales) -> None:
    rows = []
    for number, (points, _) in enumerate(fit.islands or [(fit.best[None], None)]):
        for axis, parameter in enumerate(fit.ranges):
            # Rounded as it is shown, so that its size in SI belongs to the number beside it.
            value = float(f"{parameter.at(points[0])[axis]:.4g}")
            best = with_size(parameter.name, value, scales)
            # None for the best point if no point agrees: it has no interval at any level.
            intervals = [[*fit.intervals(axis, level), None] for level in LEVELS]
            ends = [_interval(islands[number]) for islands in intervals]
            extent = f"{format_value(parameter.low)} to {format_value(parameter.high)}"
            rows.append((parameter.name, best, *ends, extent))
    title = "best" if fit.reached else "nearest"
    levels = [f"{100 * level:.0f} %" for level in LEVELS]
    header = ("parameter", title, *levels, "looked at")
    print_table(Table(header, tuple(rows), asked=3))


def _as_json(fit: Fit) -> dict[str, Any]:
    predicted, *_ = fit.predict(fit.best[None])
    means = predicted[0].tolist()
    parameters = {}
    for axis, parameter in enumerate(fit.ranges):
        intervals = {f"{100 * level:.0f}": fit.intervals(axis, level) for level in LEVELS}
        extent = parameter.low, parameter.high
        best = parameter.at(fit.best)[axis]
        parameters[parameter.name] = {"best": best, **intervals, "range": extent}
    numbers = {}
    for target, mean in zip(fit.targets, means, strict=True):
        measured = {"value": target.value, "uncertainty": target.error}
        numbers[target.name] = {**measured, "best": mean}
    points = len(fit.computed.x)
    return {"reached": fit.reached, "parameters": parameters, "numbers": numbers, "points": points}


def _interval(ends: tuple[float, float] | None) -> str:
    if not ends:
        return "none"
    texts = (format_value(float(f"{end:.3g}")) for end in ends)
    # Ends that are equal to three digits are one number.
    return " to ".join(dict.fromkeys(texts))
