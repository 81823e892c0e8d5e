"""A group of commands whose files are imported one at a time, so that help is instant."""

from collections.abc import Mapping
from importlib import import_module
from typing import Any

import click
from click.shell_completion import CompletionItem

from study.execution.launch import pin_threads


class LazyGroup(click.Group):
    """Commands known by name and one-line help. A command's file is imported when it is called or its own help is shown.

    package: holds one module for each command, of the same name, whose attribute `command` is the command.
    summaries: name of each command -> its one-line help.
    """

    def __init__(self, *arguments: Any, package: str, summaries: Mapping[str, str], **settings: Any) -> None:
        super().__init__(*arguments, **settings)
        self._package = package
        self._summaries = summaries

    def list_commands(self, ctx: click.Context) -> list[str]:
        """The names of all commands, in the order of the table."""
        return list(self._summaries)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Import a command; None where there is no such command."""
        if cmd_name not in self._summaries:
            return None
        pin_threads()  # commands import numpy, whose libraries read the number of threads once
        command = import_module(f"{self._package}.{cmd_name}").command
        assert isinstance(command, click.Command)
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the list of commands from the table alone."""
        with formatter.section("Commands"):
            formatter.write_dl(list(self._summaries.items()))

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem]:
        """Complete a command's name from the table alone."""
        found = [CompletionItem(name, help=text) for name, text in self._summaries.items()]
        return [each for each in found if each.value.startswith(incomplete)]
