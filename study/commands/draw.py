"""Commands that draw: `report`, `figure`, `profile`, `frames`, and pictures of single cases."""

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from nanoslip.solver.contact.pin import profile_slopes
from nanoslip.solver.outcome import InvalidInput, SolverError
from nanoslip.solver.sliding.validity import resolving_nodes
from nanoslip.solver.view import describe_outcome
from nanoslip.study import api, shipped
from nanoslip.study.commands.answering import middle_answer
from nanoslip.study.commands.datasets import assignments, choose_case, find_dataset, has_manifest
from nanoslip.study.commands.plans import command_text, plan_campaign, plural, refusals
from nanoslip.study.commands.reading import lines_left_out, parse_option, separation
from nanoslip.study.commands.words import Refusal
from nanoslip.study.dataset import file
from nanoslip.study.figures import shared
from nanoslip.study.figures.answer import view_named
from nanoslip.study.figures.gallery import figure_paths, list_shipped_figures, script_figures
from nanoslip.study.manifest.parameters import compact
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.manifest.surface import NamedSurface, Surface, read_surface
from nanoslip.study.measured.columns import file_text
from nanoslip.study.report import page
from nanoslip.study.report.console import Table, note, print_entries, print_sentences, print_table, whole
from nanoslip.study.report.curves import DrawnLine, print_lines
from nanoslip.study.results.files import results_folder
from nanoslip.study.results.store import StoreError, write_files

# `nanoslip report`: the HTML page of a campaign's dataset.


def write_report(campaign: Path, out: Path | None) -> None:
    """Write the page of a campaign's dataset; the run that made it has printed its table."""
    into, manifest = results_folder(campaign, out), load_manifest(campaign)
    with file.reading(into / file.FILE) as opened:
        if not has_manifest(opened, manifest):
            run = command_text("run", campaign, into)
            collect = command_text("collect", campaign, into)
            cure = f"{run} computes what is missing, {collect} takes what is finished"
            raise StoreError(f"{into / file.FILE}: no dataset of {campaign} as it is now: {cure}")
        written = page.write_page(opened, into, middle_answer(opened, manifest, into))
    note(whole(f"report: {written}"))


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
    """Draw a number of a campaign's dataset where `y` names one, else named figures, computing missing results."""
    with refusals(InvalidInput), shared.read_style(sheet):
        if y:
            if everything or not names:
                raise Refusal(f"--y {y}: needs one campaign, or a dataset (results.nc)")
            where = assignments(names[1:])
            with refusals(ValueError), find_dataset(shipped.campaign_file(Path(names[0])), out) as dataset:
                view = view_named(dataset, y, x, hue, where)
                write_and_note(_figure_files(view, output, table, size or ()))
            of = ", ".join(f"{key} = {value}" for key, value in where.items())
            note(f"{view.caption} Of {of}." if of else view.caption)
        elif x or hue or output or table or size:
            raise Refusal("--x, --hue, --output, --csv and --size: need --y, the number that is drawn")
        elif names or everything:
            _draw_named(names, everything, formats, into, out or Path("results"))
        else:
            titles = {name: figure.title for name, figure in list_shipped_figures().items()}
            print_entries(titles)
            note(f"{whole('nanoslip figure NAME')} draws one, {whole('nanoslip figure --all')} all of them")


def _figure_files(view: shared.View, output: Path | None, table: bool, size: Sequence[float]) -> dict[Path, bytes]:
    """A figure, and perhaps its numbers beside it."""
    target = output or Path(f"{view.name}.{shared.FORMATS[0]}")
    drawn = shared.resize_figure(view.draw(), size)
    files = {target: shared.image(drawn, shared.file_format(target))}
    if table:
        numbers = shared.format_csv(view.columns())
        files[target.with_suffix(".csv")] = numbers.encode()
    return files


def _draw_named(names: tuple[str, ...], everything: bool, formats: tuple[str, ...], into: Path, out: Path) -> None:
    """Draw shipped figures by name, and all that the script beside a campaign file has."""
    shipped_figures = list_shipped_figures()
    # By campaign, so that each is computed once for all its figures.
    chosen: dict[Path, list[shared.CampaignFigure]] = {}
    for name in shipped_figures if everything else names:
        campaign = Path(name)
        scripted = script_figures(campaign) if campaign.suffix == ".toml" else ()
        if scripted:
            chosen.setdefault(campaign, []).extend(scripted)
        elif name in shipped_figures:
            source = shipped.campaign_files()[shipped_figures[name].campaign]
            chosen.setdefault(source, []).append(shipped_figures[name])
        else:
            advice = f"a campaign of your own needs --y, or a script {campaign.stem}.py beside it"
            raise Refusal(f"{name}: no figure; there are {', '.join(shipped_figures)}; {advice}")
    for source, figures in chosen.items():
        with api.run(source, out / figures[0].campaign, progress=True) as dataset:
            for figure in figures:
                note(figure.title)
                head, *rows = shared.claim_rows(figure.claims(dataset), figure.header)
                print_table(Table(head, tuple(rows), len(head) - 1))
                write_and_note(figure_paths(figure, dataset, into, formats))


# `nanoslip profile`: the measured profile of a surface, what is known of its roughness, and the nodes that resolve it.


def show_profile(
    file: Path, x: str, y: str, z: str, pixel: str, missing: str, detrend: str, width: str, picture: Path | None
) -> None:
    """Print statistics of a profile, and draw it."""
    slab_width = parse_option("width", width, "m", positive=True)
    try:
        named_surface = NamedSurface(str(file), x, z, detrend, y, pixel, missing)  # type: ignore[arg-type]
        surface = read_surface(file, file_text(file), named_surface)
    except InvalidInput as error:
        raise Refusal(f"{file}: {error}") from None
    print_sentences(_surface_lines(surface, slab_width))
    if picture:
        write_and_note({picture: _draw_surface(surface, shared.file_format(picture))})
    else:
        # Of an image the row in the middle, as text shows a single line.
        middle = np.atleast_2d(surface.height)[len(surface.y) // 2]
        line = DrawnLine(1e6 * surface.x, 1e9 * middle, "x, in μm", "height, in nm")
        print_lines([line])


def _surface_lines(surface: Surface, slab_width: float) -> list[str]:
    heights = _heights_sentence(surface, slab_width)
    return [_points_sentence(surface), heights, _nodes_sentence(surface, slab_width)]


def _points_sentence(surface: Surface) -> str:
    """Number and extent of the points of a surface, and how they were read."""
    length = float(surface.x[-1] - surface.x[0])
    count = len(surface.x)
    apart = compact(length / (count - 1), "m")
    parts = [f"{count} points over {compact(length, 'm')}, {apart} apart"]
    if len(surface.y) > 1:
        width = float(surface.y[-1] - surface.y[0])
        extent = f"{compact(length, 'm')} by {compact(width, 'm')}"
        parts = [f"{count} by {len(surface.y)} points over {extent}, {apart} apart"]
    if surface.source:
        parts.append(separation(surface.source))
    if len(surface.y) <= 1 and surface.source and surface.rows:
        parts += lines_left_out(surface.source, surface.rows, surface.holes)
    if surface.filled:
        parts.append(f"{plural(surface.filled, 'missing height')} filled from neighbours")
    return "; ".join(parts)


def _heights_sentence(surface: Surface, slab_width: float) -> str:
    """Height, slopes and correlation length of a surface."""
    image = surface.image(slab_width)
    along, _ = profile_slopes(image.xi, image.height, 1.0)
    slopes = f"slope {along:.3g}"
    if len(surface.y) > 1:
        across, _ = profile_slopes(image.y, image.height.T, 1.0)
        slopes = f"slopes {along:.3g} along x and {across:.3g} along y"
    length = surface.correlation_length
    correlation = "longer than the profile" if math.isnan(length) else compact(length, "m")
    height = compact(surface.rms_height, "m")
    return f"root mean square height {height}, {slopes}; correlation length {correlation}"


def _nodes_sentence(surface: Surface, slab_width: float) -> str:
    """Nodes that resolve a surface on a slab of this width, and on one as wide as the profile."""
    slab = f"on a slab of L_x = {compact(slab_width, 'm')} (--width)"
    nodes = resolving_nodes(surface.image(slab_width))
    if not nodes:
        return f"{slab} no number of nodes resolves it: take a smaller one"
    spacing = compact(slab_width / (nodes - 1), "m")
    sentence = f"{slab} n_x = {nodes} resolves it, with nodes {spacing} apart"
    length = float(surface.x[-1] - surface.x[0])
    if length < slab_width:
        sentence += f"; one as wide as the profile needs {resolving_nodes(surface.image(length))}"
    return sentence


def _draw_surface(surface: Surface, form: str) -> bytes:
    """The profile or image above its spectrum along x."""
    wavenumber, power = surface.spectrum
    with shared.column(4.4) as figure:
        above, below = figure.subplots(2)
        if len(surface.y) > 1:
            above.set(xlabel="x (μm)", ylabel="y (μm)", aspect="equal")
            x, y = 1e6 * surface.x, 1e6 * surface.y
            heights = above.pcolormesh(x, y, 1e9 * surface.height, shading="nearest")
            figure.colorbar(heights, ax=above, label="height (nm)")
        else:
            above.plot(1e6 * surface.x, 1e9 * surface.height)
            above.set(xlabel="x (μm)", ylabel="height (nm)")
        below.plot(wavenumber, power)
        below.set(xlabel="wavenumber 2π/λ (1/m)", ylabel="power of heights (m³)", xscale="log", yscale="log")
        return shared.image(figure, form)


# `nanoslip frames`: one case of a campaign at work, event by event, as a strip of pictures or a film.


def draw_frames(campaign: Path, parameters: tuple[str, ...], events: str | None, output: Path) -> None:
    """Compute a case's contact after each of some events, or at turns of its path, and draw it."""
    with refusals(SolverError):
        from nanoslip.study.figures.frames import frames, parse_events, usual_events  # noqa: PLC0415  films need more than pictures

        # Before the campaign is read: a mistyped event is answered at once.
        wanted = parse_events(events) if events else ()
        plan = plan_campaign(campaign)
        case = choose_case(plan.manifest, plan.cases, assignments(parameters))
        if case.case is None:
            raise ManifestError.of(case.point, remark=case.outcome.message)
        wanted = wanted or usual_events(case.case)
        shown = frames(case.case, wanted, output, plan.manifest.stated_scales)
    if len(shown.moments) < len(wanted):
        ended = shown.outcome if not shown.outcome.ok else shown.record.outcome
        missing = wanted[len(shown.moments)]
        note(f"no {shown.counted} {missing}: the record ends before ({describe_outcome(ended)})", stderr=True)
    extent = f"{plural(len(shown.moments), 'moment')} to {shown.counted} {shown.moments[-1].event}"
    note(f"{whole(f'written: {output}')} ({case.point}; {extent})")


# Pictures of single cases, and what is written.


def draw_lines(lines: Sequence[DrawnLine], picture: Path) -> bytes:
    """A picture of the lines, one above the other. Raises Refusal if there is none."""
    if not lines:
        raise Refusal("this case has no friction record, motion or contact to be drawn: see [outputs] and stages")
    with shared.column(height=2.2 * len(lines)) as figure:
        panels = figure.subplots(len(lines), squeeze=False).ravel()
        for axes, line in zip(panels, lines, strict=True):
            axes.plot(line.x, line.y)
            axes.set(xlabel=line.x_label, ylabel=line.y_label)
        return shared.image(figure, shared.file_format(picture))


def write_and_note(files: Mapping[Path, bytes]) -> None:
    """Write files and print their paths. Raises StoreError."""
    write_files(files)
    for path in files:
        note(whole(f"written: {path}"))
