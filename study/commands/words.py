"""What every command has before its body is imported: arguments, help, errors in one message, the end by Ctrl-C."""

import gc
import os
import signal
import time
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, Final, TypeAlias

import click
from click.shell_completion import CompletionItem

from nanoslip.study import shipped
from nanoslip.study.exit_codes import ABORTED, WRONG_INPUT
from nanoslip.study.run.launch import LAST_WORDS, launcher_rank, pin_threads, processes_started

_CONSOLE: Final = "nanoslip.study.report.console"
"""Imported where there is something to say: help needs no terminal's width."""


class Refusal(click.ClickException):
    """The input is wrong: a message, no traceback."""

    exit_code = WRONG_INPUT


def show(error: click.ClickException) -> None:
    """Print an error once, however many processes were started together."""
    if launcher_rank() == 0:
        _print(error)
    if processes_started() > 1:
        time.sleep(LAST_WORDS)  # the end of one rank is that of all, and of what it has not been heard to say


def _print(error: click.ClickException) -> None:
    """Print an error in lines that fit the terminal; of a wrong command line its usage first."""
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        error.show()
        return
    if isinstance(error, click.UsageError) and error.ctx:
        path = error.ctx.command_path
        click.echo(f"{error.ctx.get_usage()}\nTry '{path} --help' for help.\n", err=True)
    import_module(_CONSOLE).print_error(error.format_message())


def aborted() -> int:
    """Say that Ctrl-C has ended the command, and the exit code for it; one of several ranks ends by the signal itself.

    Launchers then end the others, which may wait in MPI for this one; after an exit code they do not.
    """
    if launcher_rank() == 0:
        import_module(_CONSOLE).say("interrupted", stderr=True)
    if processes_started() > 1:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    return ABORTED


# The arguments that most commands take: a campaign, and the folder of its results.


class CampaignPath(click.Path):
    """A campaign file, or the name of a campaign that comes with nanoslip."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path of the file."""
        return shipped.campaign_file(Path(os.fsdecode(super().convert(value, param, ctx))))

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Files, and the campaigns that come with nanoslip."""
        names = [CompletionItem(name) for name in shipped.campaigns() if name.startswith(incomplete)]
        return [*super().shell_complete(ctx, param, incomplete), *names]


class NewFile(click.Path):
    """A file that is to be written, into a folder that is there."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path of the file. Raises Refusal."""
        path = Path(os.fsdecode(super().convert(value, param, ctx)))
        if not path.parent.is_dir():
            raise Refusal(f"{path}: cannot be written: there is no folder {path.parent}")
        return path


PATH: Final = click.Path(path_type=Path)
CAMPAIGN_PATH: Final = CampaignPath(path_type=Path)
NEW_FILE: Final = NewFile(path_type=Path)
POSITIVE: Final = click.IntRange(min=1)

CAMPAIGN = click.argument("campaign", type=CAMPAIGN_PATH)
PARAMETERS = click.argument("parameters", nargs=-1, metavar="[KEY=VALUE]...")
JSON = click.option("--json", "as_json", is_flag=True, help="Print JSON for scripts (keys: study/commands/README.md).")
OUT = click.option("--out", type=PATH, help="Folder of the results [default: results/<campaign>]")
PICTURE = click.option(
    "-o", "--picture", type=NEW_FILE, help="Draw a picture into this file (.png, .pdf, .svg) instead."
)


def folder(campaign: Path, out: Path | None) -> Path:
    """The folder of a campaign's results."""
    return out or Path("results") / campaign.stem


# Import the code of a command when the command is called, so that help, completion and usage errors are instant.


def work(command: str, /, **given: object) -> None:
    """Call a function of `nanoslip.study.commands`, "file:function", with the arguments of the command line. Raises Refusal."""
    pin_threads()  # what is imported now imports numpy, whose libraries read the number of threads once
    gc.set_threshold(100_000)  # of 100 000 cases little is garbage: to look for it as often as usual doubles `collect`
    file, _, function = command.partition(":")
    with import_module("nanoslip.study.commands.plans").refusals():
        getattr(import_module(f"nanoslip.study.commands.{file}"), function)(**given)


# The command `nanoslip`, which its commands are declared on.


class Group(click.Group):
    """A group that lists its commands as they are declared: in the order of a campaign's life."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names of all commands."""
        return list(self.commands)


def _say_version(context: click.Context, _option: click.Parameter, asked: bool) -> None:
    """The version of what computes, as datasets name it: of a source tree its own, whatever was installed from it once."""
    if asked and not context.resilient_parsing:
        from nanoslip.study.provenance import version  # noqa: PLC0415  no command waits for it

        click.echo(f"nanoslip, version {version()}")
        context.exit()


@click.group(cls=Group, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_say_version,
    help="Show the version and exit.",
)
def cli() -> None:
    """A friction laboratory: from campaign files (TOML) to one labelled dataset each."""


Declared: TypeAlias = Callable[..., object]


def command(
    place: str, *arguments: Callable[[Declared], Declared], name: str | None = None
) -> Callable[[Declared], click.Command]:
    """Declare a command by a function of its name with its help; `work` at this place is called with its arguments.

    arguments: those that other commands have, too; its own are decorators of the function.
    """

    def declare(described: Declared) -> click.Command:
        for each in reversed(arguments):
            described = each(described)
        declared = cli.command(name)(described)
        declared.callback = partial(work, place)
        return declared

    return declare
