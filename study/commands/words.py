"""Shared by commands: one-message errors, and Ctrl-C."""

import os
import signal
import time
from importlib import import_module
from typing import Final

import click

from nanoslip.study.exit_codes import ABORTED, WRONG_INPUT
from nanoslip.study.run.launch import LAST_WORDS, launcher_rank, processes_started

_CONSOLE: Final = "nanoslip.study.report.console"
"""Module imported only for printing: help needs no terminal's width."""


class Refusal(click.ClickException):
    """The input is wrong: a message, no traceback."""

    exit_code = WRONG_INPUT


def show(error: click.ClickException) -> None:
    """Print an error once, however many processes were started together."""
    if launcher_rank() == 0:
        _print(error)
    if processes_started() > 1:
        # The end of one rank is that of all, and of messages that have not been passed on.
        time.sleep(LAST_WORDS)


def _print(error: click.ClickException) -> None:
    """Print an error in lines that fit the terminal; of a wrong command line its usage first."""
    if isinstance(error, click.exceptions.NoArgsIsHelpError):
        error.show()
        return
    if isinstance(error, click.UsageError) and error.ctx:
        path = error.ctx.command_path
        click.echo(f"{error.ctx.get_usage()}\nTry '{path} --help' for help.\n", err=True)
    import_module(_CONSOLE).print_error(error.format_message())


def report_abort() -> int:
    """Report that Ctrl-C has ended the command, and return its exit code; one of several ranks ends by the signal itself.

    Launchers then end the others, which may wait in MPI for this one; after an exit code they do not.
    """
    if launcher_rank() == 0:
        import_module(_CONSOLE).note("interrupted", stderr=True)
    if processes_started() > 1:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
    return ABORTED
