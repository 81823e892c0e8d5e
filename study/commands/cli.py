"""The command line: every command with its arguments and help, in the order of `nanoslip --help`."""

import atexit
import errno
import gc
import io
import math
import os
import sys
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, Final, TypeAlias

import click
from click.shell_completion import CompletionItem

from nanoslip.study import shipped
from nanoslip.study.commands.words import Refusal, report_abort, show
from nanoslip.study.exit_codes import WRONG_INPUT
from nanoslip.study.memory import describe_shortage, is_shortage
from nanoslip.study.results.files import MOST_SHARDS, Shard
from nanoslip.study.run.launch import GRACE, pin_arithmetic, processes_started

__all__ = ["cli", "main"]

# The command `nanoslip`, which its commands are declared on.

flag = partial(click.option, is_flag=True)
defaulted = partial(click.option, show_default=True)


class OrderedGroup(click.Group):
    """A group that lists its commands as they are declared: in the order of a campaign's life."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names of all commands."""
        return list(self.commands)


def _print_version(context: click.Context, _option: click.Parameter, asked: bool) -> None:
    """Print the version of the running code, as datasets name it; in a source tree the tree's version, even if an
    older version was installed from it."""
    if asked and not context.resilient_parsing:
        from nanoslip.study.provenance import version  # noqa: PLC0415  no command waits for it

        click.echo(f"nanoslip, version {version()}")
        context.exit()


@click.group(cls=OrderedGroup, context_settings={"help_option_names": ["-h", "--help"]})
@flag("--version", is_eager=True, expose_value=False, callback=_print_version, help="Show the version and exit.")
def cli() -> None:
    """A friction laboratory: from campaign files (TOML) to one labelled dataset each."""


# Import the code of a command when the command is called, so that help, completion and usage errors are instant.


def work(command: str, /, **options: object) -> None:
    """Call a function of `nanoslip.study.commands`, "file:function", with the arguments of the command line. Raises Refusal."""
    # What is imported now imports numpy, whose libraries read the environment once.
    pin_arithmetic()
    # Of 100 000 cases little is garbage: to look for it as often as usual doubles the time of `collect`.
    gc.set_threshold(100_000)
    # Imports make many objects and no garbage.
    gc.disable()
    file, _, function = command.partition(":")
    refusals = import_module("nanoslip.study.commands.plans").refusals
    with refusals():
        called = getattr(import_module(f"nanoslip.study.commands.{file}"), function)
        # What is imported stays until the end: no later collection has to look at it.
        gc.freeze()
        gc.enable()
        called(**options)


Declared: TypeAlias = Callable[..., object]


def command(
    place: str, *arguments: Callable[[Declared], Declared], name: str | None = None
) -> Callable[[Declared], click.Command]:
    """Declare a command by a function of its name with its help; `work` at this place is called with its arguments.

    arguments: arguments shared with other commands; further arguments are decorators of the function.
    """

    def declare(described: Declared) -> click.Command:
        for decorate in reversed(arguments):
            described = decorate(described)
        declared = cli.command(name)(described)
        declared.callback = partial(work, place)
        return declared

    return declare


# The arguments that most commands take: a campaign, and the folder of its results.


class CampaignPath(click.Path):
    """A campaign file, or the name of a campaign that comes with nanoslip."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path of the file."""
        path = super().convert(value, param, ctx)
        return shipped.campaign_file(Path(os.fsdecode(path)))

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Files, and the campaigns that come with nanoslip."""
        names = [CompletionItem(name) for name in shipped.campaign_files() if name.startswith(incomplete)]
        return [*super().shell_complete(ctx, param, incomplete), *names]


class ResultsFolder(click.Path):
    """A folder that is not looked at before rank 0 has made it: network file systems remember for long that nothing is there."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path of the folder."""
        return Path(os.fsdecode(value))


class NewFile(click.Path):
    """A file that is to be written, into a folder that is there."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path of the file. Raises Refusal."""
        file_name = super().convert(value, param, ctx)
        path = Path(os.fsdecode(file_name))
        if not path.parent.is_dir():
            raise Refusal(f"{path}: cannot be written: there is no folder {path.parent}")
        # Refused before what goes into the file is computed.
        if str(path) != "-" and not os.access(path.parent, os.W_OK):
            raise Refusal(f"{path}: cannot be written: {os.strerror(errno.EACCES)}")
        return path


class FiniteNumber(click.FloatRange):
    """A number in a range; NaN, which no comparison refuses, is none."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        number = super().convert(value, param, ctx)
        if math.isnan(number):
            self.fail(f"{value} is not a number", param, ctx)
        return number


ANY_PATH: Final = click.Path(path_type=Path)
CAMPAIGN_PATH: Final = CampaignPath(path_type=Path)
NEW_FILE: Final = NewFile(path_type=Path)
POSITIVE: Final = click.IntRange(min=1)
SHARD_COUNT: Final = click.IntRange(1, MOST_SHARDS)
DETREND: Final = click.Choice(("none", "mean", "line", "parabola"))

CAMPAIGN = click.argument("campaign", type=CAMPAIGN_PATH)
PARAMETERS = click.argument("parameters", nargs=-1, metavar="[KEY=VALUE]...")
JSON = flag("--json", "as_json", help="Print JSON for scripts (keys: docs/commands.md).")
OUT = click.option("--out", type=ResultsFolder(), help="Folder of the results [default: results/<campaign>]")
TEXT_FILE = click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
PICTURE = click.option("-o", "--picture", type=NEW_FILE, help="Draw into this file (.png, .pdf, .svg) instead.")


# Before a campaign is computed: prepare.py.


@command("prepare:list_campaigns", JSON)
def campaigns() -> None:
    """List the campaigns that come with nanoslip.

    Run them by name, or copy them.
    """


@command("prepare:new_campaign")
@click.argument("starter", required=False)
@click.argument("file", type=ANY_PATH, required=False)
def new() -> None:
    """Write a commented campaign to start from.

    STARTER is its name; without a name the starters are listed. FILE [default: STARTER.toml] must not exist; in a folder it
    is named STARTER.toml. Files that the campaign needs are written beside it.

    Example: nanoslip new sweep campaigns/mine.toml
    """


@command("prepare:check_campaign")
@click.argument("campaigns", metavar="CAMPAIGN...", nargs=-1, required=True, type=CAMPAIGN_PATH)
def check() -> None:
    """Find every problem of campaign files, without computing.

    Each CAMPAIGN is a file, or the name of a campaign that comes with nanoslip. A correct campaign gets a line with
    its cases and tasks. Otherwise every problem gets a line: file, key, value and the allowed values.

    Python files with one's own numbers ([outputs] observables) are executed, as by `run`.

    Exit codes: 0 all are correct; 2 some are not.

    Example: nanoslip check campaigns/*.toml
    """


@command("prepare:show_plan", CAMPAIGN, OUT, JSON)
@click.option("--ranks", type=POSITIVE, help="Number of ranks to estimate the time for [default: cores here]")
@flag("--measure", help="Measure a few tasks on this machine first; no result is kept.")
def plan() -> None:
    """Show the tasks of CAMPAIGN, their time, memory and disk.

    The time is for the remaining tasks. The first estimate is right within a factor of ten; times of finished tasks, or of tasks
    measured here (--measure), correct it.
    """


@command("look:explain_case", CAMPAIGN, PARAMETERS, OUT)
@flag("--grid", "show_grid", help="Compute on half the node spacing, too, if that takes over 5 s.")
@flag("--effects", "show_effects", help="Measure what each of its effects changes and costs, too.")
def explain() -> None:
    """Explain the cost and the errors of a case of CAMPAIGN.

    KEY=VALUE select the case, and a drive, as in `show`. The output has the estimated time of its computation.
    For a computed case it ranks what decides its number: starts, length of the record, node spacing, the stress that
    a slip drops; each with its remedy. --effects adds the output of `nanoslip effects` for this
    case.

    Example: nanoslip explain campaigns/mine.toml intrinsic_friction=0.5 --effects
    """


@command("look:show_effects", CAMPAIGN)
@defaulted("--cases", type=POSITIVE, default=3, help="Number of cases, and of drives.")
@click.option("--members", type=click.IntRange(min=2), help="Members of each case [default: the campaign's, at most 8]")
def effects() -> None:
    """Measure what each effect of CAMPAIGN changes and costs.

    The first, middle and last case and drive are computed with all effects, then without one effect at a time, by the same
    members. Changes are relative, of the numbers in [target] or of the last stage: mean over these cases with ±, and range.
    Times are those without the effect over those with all. Effects that a number does not depend on are not shown. No result
    is kept.

    Example: nanoslip effects campaigns/mine.toml --members 16
    """


# Computing a campaign: run.py and prepare.py.


def _shard(_context: click.Context, _option: click.Parameter, text: str | None) -> Shard | None:
    """The part of a campaign that a text names, as `3/10`."""
    try:
        return None if text is None else Shard.parse(text)
    except ValueError as error:
        raise click.BadParameter(str(error)) from None


@command("run:run_campaign", CAMPAIGN, OUT)
@flag("--serial", help="Compute in this process alone, without MPI; no time limit ends a task.")
@click.option("-j", "--jobs", type=POSITIVE, help="Number of processes on this machine, without MPI.")
@defaulted("--grace", type=FiniteNumber(min=0.0), default=GRACE, help="Seconds for tasks to end after a signal.")
@flag("--recompute-foreign", help="Compute results of other software again (`nanoslip status` lists it).")
@flag("--retry", help="Try failed tasks again (`nanoslip status` counts them).")
@click.option(
    "--shard",
    metavar="N/OF",
    callback=_shard,
    help="Compute one part, 3/10 the third of ten, in a folder of its own; `nanoslip merge` joins the parts.",
)
def run() -> None:
    """Compute remaining tasks of CAMPAIGN, then write its dataset.

    Under mpiexec or srun all ranks compute.

    Exit codes: 0 complete; 1 a defect of the program; 2 wrong input or a full disk; 3 complete, but some tasks failed; 99
    interrupted, run again to continue.
    """


@command("prepare:show_status", CAMPAIGN, OUT, JSON)
def status() -> None:
    """Show how much of CAMPAIGN is finished, and how cases ended.

    It only reads result files. So it works during a run (`watch nanoslip status CAMPAIGN` repeats it), after an interruption, and
    on another machine.
    """


@command("judge:collect_dataset", CAMPAIGN, OUT)
@flag("--replace", help="Replace also a dataset with more finished cases.")
def collect() -> None:
    """Write the dataset of CAMPAIGN from its finished results.

    Other cases are "pending". An existing dataset with more finished cases is kept.
    """


@command("judge:merge_shards_command", CAMPAIGN, OUT)
def merge() -> None:
    """Join all shards of CAMPAIGN, and write its dataset.

    Exit codes: 0 complete; 3 complete, but some tasks failed; 99 tasks are left, which `nanoslip run` computes.
    """


@command("prepare:submit_campaign", CAMPAIGN, OUT)
@click.option(
    "--site", type=ANY_PATH, help="Settings of the cluster: a changed copy of site.toml [default: nanoslip's]"
)
@click.option("--shards", type=SHARD_COUNT, help="Number of small jobs in an array; one job more merges their results.")
@flag("--submit", help="Submit the scripts by sbatch.")
def submit() -> None:
    """Write batch scripts that run CAMPAIGN as a job, or an array."""


# Showing results: look.py and draw.py.

FORMAT: Final = click.Choice(("pdf", "svg", "png"))
"""Format of pictures; nanoslip.study.figures.shared writes them."""


@command("draw:write_report", CAMPAIGN, OUT)
def report() -> None:
    """Write the HTML page of a collected CAMPAIGN."""


@command("draw:draw_figure")
@click.argument("names", nargs=-1, metavar="[CAMPAIGN [KEY=VALUE]... | NAME...]")
@flag("--all", "everything", help="Draw every shipped figure.")
@click.option(
    "--format", "formats", multiple=True, type=FORMAT, default=FORMAT.choices, help="Of shipped figures [default: all]"
)
@defaulted(
    "--into", type=ANY_PATH, default="results", help="Folder of shipped figures; each group of campaigns has its own."
)
@click.option(
    "--out",
    type=ANY_PATH,
    help="Folder of CAMPAIGN's results [default: results/<campaign>]; of shipped figures the one above.",
)
@click.option("--y", default="", metavar="NUMBER", help="Variable of CAMPAIGN to draw, or a ratio of two.")
@click.option("--x", default="", metavar="AXIS", help="Axis of CAMPAIGN along x [default: the one with most values]")
@click.option("--hue", default="", metavar="AXIS", help="Axis with a colour for each value [default: the next one]")
@click.option("-o", "--output", type=NEW_FILE, help="File of that figure: .pdf, .svg or .png.")
@flag("--csv", "table", help="Write the numbers that are drawn to a file beside it.")
@click.option("--size", nargs=2, type=FiniteNumber(0.5, 50.0), help="Its width and height in inches, as 3.3 2.4.")
@click.option("--style", "sheet", default="", metavar="SHEET", help="Style sheet of matplotlib: a file or a name.")
def figure() -> None:
    """Draw a number of CAMPAIGN over its axes, or shipped figures.

    CAMPAIGN has been run, or is a file results.nc. Variables have names (`nanoslip describe`) or symbols. Axes beyond x and
    colour become panels. An ensemble is drawn as mean and ±. KEY=VALUE or KEY=VALUE,VALUE select cases. A
    matplotlibrc is respected.

    Example: nanoslip figure campaigns/mine.toml --y plateau/mu_i -o mine.pdf

    Without --y, NAMEs are shipped figures, each with a table that compares the paper's numbers with computed ones. Missing cases
    are computed in this process. Without names the figures are listed.
    """


@command(
    "draw:show_profile",
    TEXT_FILE,
    click.option("--x", default="", metavar="UNIT", help="Unit of positions, as nm [default: the header's, or m]"),
    click.option("--z", default="", metavar="UNIT", help="Unit of heights [default: the header's, or m]"),
    click.option("--y", default="", metavar="UNIT", help="Unit of an image's positions across, in columns x, y, z"),
    click.option("--pixel", default="", metavar="LENGTH", help="Spacing of an image that is a matrix, as 20 nm"),
    defaulted(
        "--missing", type=click.Choice(["refuse", "fill"]), default="refuse", help="Missing heights of an image."
    ),
    defaulted("--detrend", type=DETREND, default="line", help="Trend removed from the heights."),
    defaulted("--width", default="1 mm", metavar="LENGTH", help="Slab width L_x, for the nodes."),
    PICTURE,
)
def profile() -> None:
    """Report statistics of a measured surface profile or image.

    TEXT_FILE has columns of numbers, among them x and height. The output has height, slope, correlation length, and the n_x that
    resolves the profile on a slab of this width; -o draws it with its spectrum. In a campaign: heterogeneity.roughness =
    {file = "FILE", x = "nm", z = "nm"}. An image, for planes of nodes, has columns x, y, z, or is a matrix with
    Gwyddion's header or --pixel.

    Example: nanoslip profile afm.csv --x nm --z nm --width "20 um"
    """


READING = (
    click.option("--time", metavar="UNIT", help="Unit of time [default: the header's, or s]"),
    click.option("--displacement", metavar="UNIT", help="Take displacement of the stage instead, in this unit, as um."),
    click.option("--force", metavar="UNIT", help="Unit of force; 1 for a coefficient [default: the header's, or N]"),
    click.option(
        "--load",
        "loads",
        multiple=True,
        metavar="FORCE",
        help='Normal load, as "100 N": numbers become coefficients. One for all files, or one for each, in their order.',
    ),
    click.option("--velocity", metavar="VELOCITY", help='Of the stage, as "10 um/s".'),
    click.option("--columns", nargs=2, metavar="A B", help="Time or displacement, and force: names, or from 1 on."),
    click.option("--from", "start", metavar="PLACE", help='Leave out the trace before this place, as "2 s".'),
    click.option("--to", "end", metavar="PLACE", help="Leave out the trace after this place."),
    click.option("--offset", metavar="FORCE", help="Reading of the force cell without a pull; subtracted."),
    click.option("--drift", metavar="RATE", help='Drift of the force cell, as "1 mN/s" or in N/m; subtracted.'),
    click.option("--damping", type=FiniteNumber(0.0, 0.9), help="Damping ratio ζ [default: fitted to slips]"),
    click.option(
        "--rig", metavar="STIFFNESS", help='Of the machine between stage and contact, as "150 N/m"; for loops.'
    ),
)
"""Options for reading a measured trace."""


@command(
    "traces:show_traces",
    click.argument("words", nargs=-1, required=True, type=click.Path(), metavar="TEXT_FILE... [KEY=VALUE]..."),
    *READING,
    click.option(
        "--over", type=CAMPAIGN_PATH, help="Lay it over a drive or loops of this CAMPAIGN, and compare numbers."
    ),
    click.option("-o", "--picture", type=NEW_FILE, help="Draw it into this file (.png, .pdf, .svg), too."),
    click.option("--events", type=NEW_FILE, help="Write each fall of the force into this file (CSV), too."),
    JSON,
)
def trace() -> None:
    """Measure friction in a force that a laboratory recorded.

    TEXT_FILE has columns: time or displacement, force, perhaps normal load, found by their names and units. μ_s, μ_k, period,
    amplitude and rising stiffness come from a fit of Eq. 16-19 to each slip, their ± from the scatter between slips.
    Steady sliding gives μ_k alone; strokes to and fro give half their difference, without their common drift. A
    column of positions that turn gives loops: energy of a cycle, friction at mid-stroke and at turns, stiffness and
    slip amplitude. With --over, KEY=VALUE select a computed drive of CAMPAIGN, whose first slip is drawn at the time
    of the first slip in TEXT_FILE; measured loops are drawn over computed loops of a drive with stage_stroke, or of a path.

    Several files are rows of one table. Where their loads differ, friction over load is a line: slope, intercept,
    correlation, and -o draws it. --events writes time, size, recurrence and stiffness of each fall of the force, and
    prints the distributions of sizes and recurrences.

    Example: nanoslip trace lab.csv --time s --force mN --load "2 N" -o lab.png
    """


@command("look:show_dataset", CAMPAIGN, PARAMETERS, OUT, PICTURE, name="show")
def show_case() -> None:
    """Show one case of CAMPAIGN: its numbers and a small plot.

    CAMPAIGN is a campaign file or its name, a dataset (results.nc) or its folder. KEY=VALUE select the case by exact values of
    its parameters. Without a dataset, finished results are shown. An ensemble is one case, unless member=NUMBER selects a
    member. Drives are rows of a table, unless drive=NAME selects one.

    Example: nanoslip show campaigns/mine.toml intrinsic_friction=0.5 normal_load=1e-3
    """


@command("look:try_campaign", PARAMETERS, PICTURE, name="try")
@flag("--contact", help="Compute initial contact only.")
@flag("--drive", help="Pull the pin by the paper's drive, too. Any key of [[drives]] implies it.")
@click.option(
    "--stroke", metavar="LENGTH", help="Move the pin to and fro: end to end, as '2 mm', or presliding lengths."
)
@flag("--critical", help="Find the velocity above which the pin no longer sticks. Implies --drive.")
@flag("--all", "everything", help="Show all numbers and lines.")
def try_case() -> None:
    """Compute one case now and show it; nothing is written to disk.

    KEY=VALUE are keys of a campaign: parameters, [scales], [ensemble], [outputs] and [[drives]]. All others have their defaults:
    the paper's case at 129 nodes, over eight presliding lengths. If that would take longer than seconds, as of a ball, n_x is
    smaller. The answer comes first and last: friction with the ± of its starts, then what decides it beside them: the same case
    on half and twice the node spacing, in a few seconds.

    Exit codes: 0 computed, also where physics refuses the case (steep_pin, no_plateau); 2 wrong input; 3 the computation failed.

    Example: nanoslip try radius=50 normal_load=1e-3
    """


@command("draw:draw_frames", CAMPAIGN, PARAMETERS)
@click.option("--events", help="Numbers, as first:last:step or 0,5,12 [default: 0:200:40, or the first turns]")
@defaulted(
    "-o", "--output", type=NEW_FILE, default="frames.png", help="A strip (.png, .pdf, .svg) or film (.gif, .mp4)."
)
def frames() -> None:
    """Draw the contact of a case of CAMPAIGN, event by event.

    Pressure, shear, slip and F/W are computed from the campaign file; no results are needed. KEY=VALUE select the
    case by values on its axes. An event is a slip, release or touch of a node; of a path its turns are numbered. 0 is
    initial contact.

    Example: nanoslip frames smoke intrinsic_friction=0.5 --events 0:200:10 -o pin.gif
    """


# Inference of parameters from numbers: infer.py.


@command("infer:show_sensitivity", click.argument("dataset", type=CAMPAIGN_PATH), OUT, PICTURE, JSON)
@click.option("--of", required=True, metavar="NUMBER", help="Variable, symbol, or a ratio of two, as static_friction.")
def sensitivity() -> None:
    """Show which parameters a number of DATASET depends on.

    DATASET is a file results.nc, its folder, or a campaign that has been run, of any design. First-order Sobol' indices are
    shares of the number's variance by one parameter alone; total indices include interactions. Both have 95 % intervals. Failed
    cases are omitted, flagged ones used and named; the variance of ± is subtracted.

    Example: nanoslip sensitivity results/mine --of static_friction
    """


@command("infer:fit_campaign", CAMPAIGN)
@click.argument("numbers", nargs=-1, metavar="NUMBER=VALUE±ERROR... [KEY=VALUE]...")
@click.option(
    "--trace",
    type=ANY_PATH,
    help="Take μ_s and μ_k, or the numbers of loops, with their ±, from `nanoslip trace --json`.",
)
@click.option("--vary", multiple=True, metavar="KEY[=FROM:TO],...", help="Parameters to find [default: the axes]")
@defaulted("--points", type=click.IntRange(min=16), default=256, help="Most points that are computed.")
@click.option("-j", "--jobs", type=POSITIVE, help="Number of processes on this machine, without MPI.")
@OUT
@defaulted("-o", "--picture", type=NEW_FILE, default="fit.png", help="File of the figure: .png, .pdf or .svg.")
@JSON
def fit() -> None:
    """Find parameters that agree with measured numbers.

    NUMBER is a variable, its symbol, or a ratio of two; ERROR is one standard deviation, and ± may be typed as +-. KEY=VALUE
    holds a parameter, or drive=NAME chooses a drive. Cases of CAMPAIGN are computed, more of them in doubtful places; finished
    ones are used. The output has the best point, the range of each parameter at 68 and 95 %, and parameters that cannot be told
    apart.

    Exit codes: 0 searched, reached or not; 2 wrong input; 99 interrupted, run again to continue.

    Example: nanoslip fit campaigns/mine.toml mu_s=0.3+-0.01 mu_k=0.26+-0.01 --vary mu_i=0.1:0.8,radius -j 2
    """


# Exporting and comparing numbers: judge.py.


@command("judge:export_dataset", CAMPAIGN, OUT)
@click.option("--csv", "form", flag_value="csv", help="As CSV: names with units, rows [default].")
@click.option("--json", "form", flag_value="json", help="As JSON: title, variables with unit and meaning, rows.")
@click.option("--records", "table", flag_value="records", help="The events of all friction records instead of cases.")
@click.option("--paths", "table", flag_value="paths", help="The points of all paths instead of cases.")
@click.option("--trajectories", "table", flag_value="trajectories", help="The samples of all drives instead of cases.")
@click.option("-o", "--output", type=NEW_FILE, help="Write this file; - is standard output [default].")
def export() -> None:
    """Write CAMPAIGN's numbers as a table.

    CAMPAIGN is a campaign file or its name, a dataset (results.nc) or its folder. The table has a row for each case, or for each
    drive of each case: parameters first, then numbers. Missing numbers are empty in CSV and null in JSON.

    Example: nanoslip export results/mine --csv -o mine.csv
    """


@command("judge:compare_datasets")
@click.argument("first", metavar="A", type=CAMPAIGN_PATH)
@click.argument("second", metavar="B", type=CAMPAIGN_PATH)
def compare() -> None:
    """Show what differs between datasets A and B, and how much.

    Each is a dataset (results.nc), its folder, or a campaign. Cases with equal values of all varying parameters are compared; an
    ensemble is one case. Numbers with an uncertainty agree within 2 combined standard deviations, texts if they are equal.
    Other numbers are listed if they differ, and records, paths and trajectories counted; they are not judged, as they state no
    uncertainty. Cases of only one dataset are counted.

    Exit codes: 0 same or within uncertainties; 1 a difference beyond them; 2 nothing to compare.

    Example: nanoslip compare results/mine results/finer
    """


@command("judge:verify_dataset", JSON)
@click.argument("dataset", type=ANY_PATH)
@click.option("--sample", type=POSITIVE, help="Number of cases, evenly spread, the same each time [default: all]")
def verify() -> None:
    """Compute DATASET again from the file alone, and compare.

    DATASET is a file results.nc, or the folder it is in. Each case is bit-identical, within rounding, within uncertainties, or
    different. Only if DATASET was computed with another arithmetic or software may a record differ within its uncertainties.

    Exit codes: 0 no case is different; 1 a case is different; 2 DATASET cannot be computed again.
    """


@command("judge:describe_variables", JSON)
@click.argument("name", required=False)
def describe() -> None:
    """Explain a variable of a dataset, or a key of a campaign.

    NAME is a variable, a key or a symbol, such as plateau_mean, radius or mu_k; without it a table of all variables.
    """


@command("accuracy:show_accuracy", OUT)
@click.argument("campaign", type=CAMPAIGN_PATH, required=False)
@flag("--quick", help="Measure few values of every setting: a trial that takes seconds.")
def accuracy() -> None:
    """Measure error against time for every numerical setting.

    It is measured on the first case of CAMPAIGN [default: the paper's case].

    Example: nanoslip accuracy campaigns/mine.toml --quick
    """


def main() -> None:
    """Run the command line and exit."""
    _print_what_can_be_printed()
    # A launcher's pipes have no width.
    if processes_started() > 1:
        os.environ.setdefault("COLUMNS", f"{_columns()}")
    # To search all modules for cycles before the process ends anyway takes 0.3 s.
    atexit.register(gc.freeze)
    try:
        code = cli.main(prog_name="nanoslip", standalone_mode=False)
    except click.ClickException as error:
        show(error)
        code = error.exit_code
    except click.Abort:
        code = report_abort()
    except (MemoryError, ImportError, RuntimeError, SystemError) as error:
        code = _report_shortage(error)
    except OSError as error:
        if error.filename is None and error.errno != errno.ENOSPC:
            sys.exit(_report_shortage(error))
        # A disk that is full, a name that is too long, a folder that is not ours to read.
        show(Refusal(f"{error.filename or 'output'}: {error.strerror}"))
        code = WRONG_INPUT
    sys.exit(code or 0)


def _report_shortage(error: BaseException) -> int:
    """Report a shortage of memory, and return the exit code; raises other errors again."""
    if not is_shortage(error):
        raise error
    show(Refusal(describe_shortage()))
    return WRONG_INPUT


def _columns() -> int:
    """Width of the terminal that standard input or error is, in letters; 80 where neither is one."""
    for stream in (0, 2):
        with suppress(OSError):
            return os.get_terminal_size(stream).columns or 80
    return 80


def _print_what_can_be_printed() -> None:
    """A terminal whose letters have no μ shows a question mark instead of a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="replace")
