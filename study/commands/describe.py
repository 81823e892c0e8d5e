"""`nanoslip describe`: names, units and meanings of the variables of a dataset."""

import click

from study.commands.shared.exits import Refusal
from study.dataset.description import Described, described, rows
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
        _print_one(described(name))
    except KeyError as error:
        raise Refusal(error.args[0]) from None


def _print_one(one: Described) -> None:
    click.echo(f"{one.name}: {one.meaning}")
    parts = {"unit": one.units, "over": one.dims, "uncertainty": one.uncertainty, "comment": one.comment}
    for label, text in parts.items():
        if text:
            click.echo(f"  {label}: {text}")
