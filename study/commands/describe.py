"""`nanoslip describe`: names, units and meanings of the variables of a dataset."""

import click

from study.commands.shared.exits import Refusal
from study.dataset.description import described, rows, text_of
from study.report.console import Table, print_table


def work(name: str | None) -> None:
    """Print what one variable of a dataset is, or a table of all."""
    if name is None:
        print_table(Table(("variable", "unit", "meaning"), tuple((one.name, one.units, one.meaning) for one in rows())))
        return
    try:
        click.echo(text_of(described(name)))
    except KeyError as error:
        raise Refusal(error.args[0]) from None
