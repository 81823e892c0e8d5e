"""`nanoslip describe`: names, units and meanings of the variables of a dataset."""

import click

from study.commands.shared.exits import Refusal
from study.dataset.description import described, rows, text_of
from study.report.console import Table, print_table


@click.command("describe")
@click.argument("name", required=False)
def command(name: str | None) -> None:
    """Explain the variables of a dataset (results.nc), or one of them.

    NAME is a variable; without it a table of all is printed.
    """
    if name is None:
        print_table(Table(("variable", "unit", "meaning"), tuple((one.name, one.units, one.meaning) for one in rows())))
        return
    try:
        click.echo(text_of(described(name)))
    except KeyError as error:
        raise Refusal(error.args[0]) from None
