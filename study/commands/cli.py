"""The command line: importing this file declares every command, in the order of the imports."""
# ruff: noqa: I001  that is the order of a campaign's life

import atexit
import gc
import io
import sys

import click

from nanoslip.study.commands.preparing import declared as preparing
from nanoslip.study.commands.computing import declared as computing
from nanoslip.study.commands.looking import declared as looking
from nanoslip.study.commands.judging import declared as judging
from nanoslip.study.commands.shared.exits import Refusal, aborted, show
from nanoslip.study.run.launch import WRONG_INPUT
from nanoslip.study.commands.shared.group import cli

__all__ = ["cli", "computing", "judging", "looking", "main", "preparing"]


def main() -> None:
    """Run the command line and exit."""
    _print_what_can_be_printed()
    atexit.register(gc.freeze)  # searching all modules for cycles before the process ends anyway takes 0.3 s
    try:
        code = cli.main(prog_name="nanoslip", standalone_mode=False)
    except click.ClickException as error:
        show(error)
        code = error.exit_code
    except click.Abort:
        code = aborted()
    except OSError as error:
        if error.filename is None:
            raise
        show(Refusal(f"{error.filename}: {error.strerror}"))  # a name too long, a folder that is not ours to read
        code = WRONG_INPUT
    sys.exit(code or 0)


def _print_what_can_be_printed() -> None:
    """A terminal whose letters have no μ shows a question mark instead of a traceback."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper) and stream.errors == "strict":
            stream.reconfigure(errors="replace")
