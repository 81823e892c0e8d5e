"""Commands that show results: report, figure, show, try, frames, profile, effects, explain."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from pathlib import Path
from typing import Final

import click
import xarray as xr

from nanoslip.solver.case import Case
from nanoslip.solver.contact.pin import Pin, pin_of
from nanoslip.solver.outcome import InvalidInput, SolverError, quoted
from nanoslip.solver.parameter import Parameter
from nanoslip.solver.sliding.validity import MISSED, MISSING
from nanoslip.study import api, shipped
from nanoslip.study.accuracy.effects import FINER, Influence, Scenes, influences, scenes_of
from nanoslip.study.commands.datasets import assignments, chosen, dataset_of, is_of, single
from nanoslip.study.commands.plans import advised, counted, planned, refusals
from nanoslip.study.commands.words import Refusal, folder
from nanoslip.study.dataset import file
from nanoslip.study.dataset.access import scales_of
from nanoslip.study.dataset.variables import are_means
from nanoslip.study.figures.frames import events_of, frames
from nanoslip.study.figures.gallery import figures_of, files_of, shipped_figures
from nanoslip.study.figures.shared import (
    FORMATS,
    CampaignFigure,
    View,
    column,
    csv_of,
    format_of,
    image,
    resized,
    styled,
)
from nanoslip.study.figures.sweep import view_named
from nanoslip.study.manifest.cases import campaign_of, expand
from nanoslip.study.manifest.checker import ManifestError, number_or_text
from nanoslip.study.manifest.columns import text_of
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import STANDARD, compact, make_case, plain, si_line, words
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.manifest.surface import NamedSurface, Surface, read_surface
from nanoslip.study.plan.cost import condensation_seconds, record_seconds, touch_seconds
from nanoslip.study.plan.grids import Front, load_front, settled
from nanoslip.study.plan.plan import plan_of
from nanoslip.study.plan.task import idle
from nanoslip.study.report import page, summary
from nanoslip.study.report.console import (
    FAILED,
    Table,
    console,
    print_entries,
    print_sentences,
    print_table,
    say,
    whole,
)
from nanoslip.study.report.curves import MARGIN, WIDTH, Curve, curves, text_plot
from nanoslip.study.report.summary import Error, error_lines
from nanoslip.study.results.store import StoreError, write_files
from nanoslip.study.run.progress import roughly


def show_dataset(campaign: Path, parameters: tuple[str, ...], out: Path | None, picture: Path | None) -> None:
    """Print the case of a campaign that has these parameters, or draw it."""
    given = assignments(parameters)
    if picture:
        format_of(picture)
    with dataset_of(campaign, out) as found:
        say(found.attrs["title"])
        show_case(found, given, picture)


# `nanoslip report`: the HTML page of a campaign's dataset.


def write_report(campaign: Path, out: Path | None) -> None:
    """Write the page of a campaign's dataset; the run that made it has printed its table."""
    into = folder(campaign, out)
    with file.reading(into / file.FILE) as opened:
        if not is_of(opened, load_manifest(campaign)):
            run, collect = (advised(each, campaign, into) for each in ("run", "collect"))
            raise StoreError(
                f"{into / file.FILE}: no dataset of {campaign} as it is now: {run} computes what is missing, "
                f"{collect} takes what is finished"
            )
        written = page.write(opened, into)
    say(whole(f"report: {written}"))


# `nanoslip figure`: a number of a campaign over its axes; figures of the shipped campaigns, with their tables.


def draw_figure(
    names: tuple[str, ...],
    everything: bool,
    formats: tuple[str, ...],
    into: Path,
    out: Path | None,
    y: str,
    x: str,
    hue: str,
    output: Path | None,
    table: bool,
    size: tuple[float, float] | None,
    sheet: str,
) -> None:
    """Draw a number of a campaign's dataset where `y` names one, else named figures, computing what they lack."""
    with refusals(InvalidInput), styled(sheet):
        if y:
            if everything or not names:
                raise Refusal(f"--y {y}: needs one campaign, or a dataset (results.nc)")
            where = assignments(names[1:])
            with refusals(ValueError), dataset_of(shipped.campaign_file(Path(names[0])), out) as dataset:
                view = view_named(dataset, y, x, hue, where)
                write(_files_of(view, output, table, size))
            say(
                view.caption
                + (f" Of {', '.join(f'{key} = {value}' for key, value in where.items())}." if where else "")
            )
        elif x or hue or output or table or size:
            raise Refusal("--x, --hue, --output, --csv and --size: need --y, the number that is drawn")
        elif names or everything:
            _draw_named(names, everything, formats, into, out or Path("results"))
        else:
            print_entries({name: figure.title for name, figure in shipped_figures().items()})
            say(f"{whole('nanoslip figure NAME')} draws one, {whole('nanoslip figure --all')} all of them")


def _files_of(view: View, output: Path | None, table: bool, size: tuple[float, float] | None) -> dict[Path, bytes]:
    """A figure, and perhaps its numbers beside it."""
    target = output or Path(f"{view.name}.{FORMATS[0]}")
    files = {target: image(resized(view.draw(), size or ()), format_of(target))}
    return files | ({target.with_suffix(".csv"): csv_of(view.columns()).encode()} if table else {})


def _draw_named(names: tuple[str, ...], everything: bool, formats: tuple[str, ...], into: Path, out: Path) -> None:
    """Draw shipped figures by name, and all that the script beside a campaign file has."""
    known = shipped_figures()
    chosen: dict[Path, list[CampaignFigure]] = {}
    for name in known if everything else names:
        of_file = figures_of(Path(name)) if Path(name).suffix == ".toml" else ()
        if name not in known and not of_file:
            there = ", ".join(known)
            own = f"a campaign of your own needs --y, or a script {Path(name).stem}.py beside it"
            raise Refusal(f"{name}: no figure; there are {there}; {own}")
        for figure in of_file or (known[name],):
            chosen.setdefault(Path(name) if of_file else shipped.campaigns()[figure.campaign], []).append(figure)
    for source, figures in chosen.items():
        with api.run(source, out / figures[0].campaign, progress=True) as dataset:
            for figure in figures:
                say(figure.title)
                print_table(Table(figure.header, tuple(figure.claims(dataset)), 3))
                write(files_of(figure, dataset, into, formats))


# `nanoslip profile`: the measured profile of a surface, what is known of its roughness, and the nodes that resolve it.


def show_profile(file: Path, x: str, z: str, detrend: str, width: str, picture: Path | None) -> None:
    """Print statistics of a profile, and draw it."""
    try:
        slab_width = float(plain(width, Parameter("slab width", unit="m")))
    except ValueError:
        slab_width = math.nan
    if not 0.0 < slab_width < math.inf:
        raise Refusal(f'--width = {quoted(width)}: needs a length above 0, as "1 mm"')
    try:
        found = read_surface(file, text_of(file), NamedSurface(str(file), x, z, detrend))  # type: ignore[arg-type]
    except InvalidInput as error:
        raise Refusal(f"{file}: {error}") from None
    print_sentences(_surface_lines(found, slab_width))
    if picture:
        write({picture: _surface_drawn(found, format_of(picture))})
    else:
        print_lines([Curve(1e6 * found.x, 1e9 * found.height, "x, in μm", "height, in nm")])


def pin_under(found: Surface, slab_width: float) -> Pin:
    """Its roughness on a flat pin; slab_width: in m."""
    return Pin(0.0, math.inf, found.x / slab_width, found.height / slab_width)


def nodes_for(pin: Pin) -> int | None:
    """The smallest n_x = 2^N + 1 of which nodes see enough of a rough pin's slope; None if none does."""
    for power in range(2, MOST_NODES + 1):
        slope, missed = pin.roughness_slopes(0.5**power)
        if missed <= MISSED * slope:
            return int(2**power + 1)
    return None


MOST_NODES: Final = 20
"""Power of two of the most nodes that a slab may have, less one."""


def _surface_lines(found: Surface, slab_width: float) -> list[str]:
    length, count = float(found.x[-1] - found.x[0]), len(found.x)
    pin = pin_under(found, slab_width)
    slope, _ = pin.roughness_slopes(1.0)
    nodes, apart = nodes_for(pin), compact(length / (count - 1), "m")
    correlated = found.correlation_length
    longer = "longer than the profile" if math.isnan(correlated) else compact(correlated, "m")
    slab = f"on a slab of L_x = {compact(slab_width, 'm')} (--width)"
    resolved = f"{slab} no number of nodes resolves it: take a smaller one"
    if nodes:
        resolved = f"{slab} n_x = {nodes} resolves it, with nodes {compact(slab_width / (nodes - 1), 'm')} apart"
    return [
        f"{count} points over {compact(length, 'm')}, {apart} apart; numbers are separated by {found.separator}, "
        f"below {counted(found.skipped, 'line')}",
        f"root mean square height {compact(found.rms_height, 'm')}, slope {slope:.3g}; correlation length {longer}",
        resolved,
    ]


def _surface_drawn(found: Surface, form: str) -> bytes:
    """The profile above its spectrum."""
    wavenumber, power = found.spectrum
    with column(4.4) as figure:
        above, below = figure.subplots(2)
        above.plot(1e6 * found.x, 1e9 * found.height)
        above.set(xlabel="x (μm)", ylabel="height (nm)")
        below.plot(wavenumber, power)
        below.set(xlabel="wavenumber 2π/λ (1/m)", ylabel="power of heights (m³)", xscale="log", yscale="log")
        return image(figure, form)


# `nanoslip frames`: one case of a campaign at work, event by event, as a strip of pictures or a film.


def draw_frames(campaign: Path, parameters: tuple[str, ...], events: str, output: Path) -> None:
    """Compute a case's contact after each of some events, and draw it."""
    with refusals(SolverError):
        wanted = events_of(events)
        plan = planned(campaign)
        case = chosen(plan.manifest, plan.cases, assignments(parameters))
        if case.case is None:
            raise ManifestError([f"{case.point}: {case.outcome.message}"])
        shown = frames(case.case, wanted, output)
    if len(shown.moments) < len(wanted):
        ended = shown.outcome if not shown.outcome.ok else shown.record.outcome
        reason = f"{ended.ending}: {ended.message}".rstrip(": ")
        say(f"no event {wanted[len(shown.moments)]}: the record ends before ({reason})", stderr=True)
    last = shown.moments[-1].event
    say(f"{whole(f'written: {output}')} ({case.point}; {counted(len(shown.moments), 'moment')} to event {last})")


# `nanoslip try`: one case from the command line, computed at once; nothing stays on disk.


def try_campaign(parameters: tuple[str, ...], contact: bool, drive: bool, picture: Path | None) -> None:
    """Compute one case in this process and print it, or draw it."""
    if contact and drive:
        raise click.UsageError("--contact and --drive exclude each other")
    given = assignments(parameters)
    if picture:
        format_of(picture)  # what cannot be drawn is better known before it is computed
    with refusals(MemoryError), _as_typed():
        found = api.run(campaign_of(given, contact, drive), progress=True)
    print_sentences(_idle(given, contact))
    show_case(found, {}, picture)


def _idle(given: Mapping[str, str], contact: bool) -> Iterator[str]:
    """The parameters that were given and change nothing, as in campaigns, each with the reason."""
    values = {words()[key]: number_or_text(text) for key, text in given.items() if key in words()}
    with suppress(InvalidInput):  # the case is refused, and says why
        yield from idle([make_case(values)], values.keys(), contact)


@contextmanager
def _as_typed() -> Iterator[None]:
    """Name keys in problems as they were typed: without a file, and the tables that a campaign has them in."""
    try:
        yield
    except ManifestError as error:
        places = re.compile(rf"({re.escape(str(api.DICT))}: (\w+(\[\d+\])?\.)?)?")
        raise ManifestError(places.sub("", line, count=1) for line in error.lines) from None


# `nanoslip effects`: what a campaign's numbers lose without each of its effects, and the time that this saves.

_HEADER = ("effect", "number", "change ±", "seconds ×", "setting")


def show_effects(campaign: Path, cases: int, members: int | None) -> None:
    """Compute a few cases with everything and without each effect, and print the changes."""
    manifest = settled(load_manifest(campaign))
    print_changes(campaign, scenes_of(manifest, list(expand(manifest)), cases, members))


def print_changes(campaign: Path, scenes: Scenes) -> None:
    """Compute these scenes with everything and without each effect, and print the changes."""
    size = f"{counted(len(scenes.cases), 'case')}, {counted(scenes.ensemble.members, 'member')} each"
    say(f"{campaign}: computing {size}, with everything and without one effect at a time", stderr=True)
    found, failures = influences(scenes)
    print_sentences(f"case {number}: {each.point}" for number, each in enumerate(scenes.cases, start=1))
    print_sentences((f"with everything, {each}" for each in failures), FAILED)
    if not found:
        say("nothing to compare: no number of these cases depends on an effect that can be left out")
        return
    rows = tuple(map(_row, found))
    failed = frozenset(place for place, each in enumerate(found) if each.problems)
    print_table(Table(_HEADER, rows, labels=2, asked=2, failed=failed))
    say(
        "Below each effect: what leaves it out, and where the change is largest. seconds ×: without it, over everything"
    )


def _row(each: Influence) -> tuple[str, ...]:
    largest, where = each.largest, f"case {each.largest.where}"
    change, seconds, named = "–", "–", True
    if math.isfinite(largest.change):
        change = f"{largest.change:+.2g} ± {largest.uncertainty:.1g}" if largest.change else "0"
        seconds = f"{each.seconds:.2g}"
        named = any(problem.startswith(f"{where}: ") for problem in each.problems[:1])
    sentences = [each.setting, *([] if named else [where]), *each.problems[:1]]
    return each.effect, each.variable, change, seconds, "; ".join(sentences)


# `nanoslip explain`: one case before it is computed: its estimated time, the error of its grid, and what half of that costs.


def explain_case(
    campaign: Path, parameters: tuple[str, ...], out: Path | None, show_grid: bool, show_effects: bool
) -> None:
    """Print cost and errors, and perhaps what grid and effects change, of the case of a campaign that has these parameters."""
    manifest = settled(load_manifest(campaign))
    case = chosen(manifest, expand(manifest), assignments(parameters))
    if case.case is None:
        raise Refusal(f"{case.point}: {case.outcome.message}")
    seconds = sum(task.cost for task in plan_of(manifest, [case]).tasks)
    front = load_front(manifest.front, manifest.files.get("front"))
    slides = "slip" in manifest.stages
    grid, rough = _of_grid(case.case, front, slides), _of_roughness(case.case, slides)
    print_sentences([f"case {case.point}", f"estimated time, roughly: {roughly(seconds)}", grid, rough])
    scenes, measured = scenes_of(manifest, [case], SHOWN), dict[str, Error]()
    if show_grid:
        finer, failures = influences(scenes._replace(of_cases=(FINER,), of_drives=()))
        print_sentences(failures, FAILED)
        measured = {each.variable: _of_finer(each) for each in finer}
    path, cost = folder(campaign, out) / file.FILE, roughly(3.0 * seconds)
    print_sentences(_errors(path, manifest, parameters, cost, measured))
    if show_effects:
        print_changes(campaign, scenes)


def _of_finer(each: Influence) -> Error:
    change = f"twice as many nodes change it by {each.largest.change:+.1%} ± {each.largest.uncertainty:.1%}"
    cure = f"{change}, in {each.seconds:.2g} × the time of this grid (another surface for what slips)"
    return Error("the grid", abs(each.largest.change), cure)


def _errors(
    path: Path, manifest: Manifest, parameters: tuple[str, ...], cost: str, measured: Mapping[str, Error]
) -> list[str]:
    """Error budget of a computed case."""
    if path.is_file():
        with file.reading(path) as found:
            if is_of(found, manifest):
                return list(error_lines(single(found, assignments(parameters)), cost, measured, SHOWN))
    lines = [f"{name}: {each.cure}" for name, each in measured.items()]
    return [*lines, "not computed yet: afterwards explain names the largest error of each number"]


SHOWN: Final = 3
"""Drives whose effects are shown: the first, the middle and the last one."""


def _of_grid(case: Case, front: Front, slides: bool) -> str:
    """The error of the grid, and the fastest measured grid that has half of it."""
    error = front.expected_error(case)
    if math.isnan(error):
        return "error of the grid: not measured for such a slab and contact"
    said = f"error of the grid, of contact, approach and stiffness: {error:.2g}"
    contacts = front.comparable(case)
    better = [
        row
        for row in front.like(case.slab)
        if row.slab.scheme.name == case.slab.scheme.name and front.worst_error(row.slab, contacts) <= 0.5 * error
    ]
    if not better:
        return f"{said}; no measured grid of this scheme has half of it"
    best = min(better, key=lambda row: row.seconds)
    times = _seconds(replace(case, slab=best.slab), slides) / _seconds(case, slides)
    grid = f"n_x = {best.slab.n_x}, {best.slab.scheme} (another surface for what slips)"
    return f"{said}; half of it costs {times:.2g} × the time of this grid: {grid}"


def _of_roughness(case: Case, slides: bool) -> str:
    """What nodes miss of the pin's roughness, by how much that changes plateaus, and what resolves it; empty of a smooth pin."""
    pin = pin_of(case)
    slope, missed = pin.roughness_slopes(case.slab.spacing)
    if not slope:
        return ""
    said = f"roughness: nodes miss {missed / slope:.0%} of its slope; plateaus are {MISSING}"
    if missed <= MISSED * slope or not (nodes := nodes_for(pin)):
        return said
    times = _seconds(replace(case, slab=replace(case.slab, n_x=nodes)), slides) / _seconds(case, slides)
    return f"{said}; n_x = {nodes} resolves it, in {times:.2g} × the time of this grid"


def _seconds(case: Case, slides: bool) -> float:
    return condensation_seconds(case.slab) + (record_seconds(case) if slides else touch_seconds(case))


# One case of a dataset on the terminal: how it ended, its numbers, its lines in text; or its lines as a picture.

_NAMES: Final = ("case_id", "case")
"""Coordinates that are no parameters."""


def show_case(dataset: xr.Dataset, given: Mapping[str, str], picture: Path | None) -> None:
    """Print the case that parameters single out, or write its picture besides. Raises Refusal where it is not one case."""
    case = single(dataset, given)
    _print_numbers(case, dataset)
    lines = list(curves(case))
    if lines and are_means(case):
        say("lines are those of the first member")
    if picture:
        write({picture: _drawn(lines, format_of(picture))})
    else:
        print_lines(lines)
    if lines and (answer := summary.answer(case)):  # which has scrolled away
        say(answer)


def write(files: Mapping[Path, bytes]) -> None:
    """Write files, and say where. Raises StoreError."""
    write_files(files)
    for path in files:
        say(whole(f"written: {path}"))


def print_lines(lines: Iterable[Curve]) -> None:
    """Plot lines in text, as wide as there is room."""
    width = min(WIDTH, console().width - MARGIN)
    for line in lines:
        click.echo(text_plot(line.x, line.y, (line.x_label, line.y_label), width))


def _print_numbers(case: xr.Dataset, dataset: xr.Dataset) -> None:
    """Print parameters, outcome and numbers of a case; several drives as rows."""
    values = {str(name): each.item() for name, each in case.coords.items() if not each.dims}
    scales = scales_of(dataset.attrs)
    in_si = [si_line(scales, values, {})] if scales else []
    print_sentences([f"case {_label(case, dataset)}", *in_si, *summary.ending_lines(case)])
    table, others = summary.case_table(case)
    if table.rows:
        print_table(table)
    print_sentences(f"{why}: {', '.join(names)}" for why, names in others.items())
    if "drive_outcome" in case and case["drive_outcome"].dims:
        say("several drives; drive=NAME, or values of their parameters, shows one:")
        print_table(summary.scalar_table(case, why=False))
        print_sentences(summary.failure_summary(case), FAILED)


def _label(case: xr.Dataset, dataset: xr.Dataset) -> str:
    """The parameters that tell a case from the dataset's others; the standard ones always."""
    names = [str(name) for name, each in case.coords.items() if not each.dims and name not in _NAMES]
    told = [name for name in names if name in STANDARD or len(set(dataset[name].values.ravel().tolist())) > 1]
    if "pin" in case and case["pin"].item() == "flat_punch":  # which has no radius
        told = ["half_width" if name == "radius" else name for name in told if name not in ("pin", "half_width")]
        told.insert(0, "pin")
    return summary.words({name: case[name].item() for name in told if not case[name].isnull()})


def _drawn(lines: Sequence[Curve], form: str) -> bytes:
    """A picture of the lines, one above the other. Raises Refusal where there is none."""
    if not lines:
        raise Refusal("this case has no friction record, motion or contact to be drawn: see [outputs] and stages")
    with column(height=2.2 * len(lines)) as figure:
        for axes, line in zip(figure.subplots(len(lines), squeeze=False).ravel(), lines, strict=True):
            axes.plot(line.x, line.y)
            axes.set(xlabel=line.x_label, ylabel=line.y_label)
        return image(figure, form)
