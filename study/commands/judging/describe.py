"""`nanoslip describe`: names, units and meanings of the variables of a dataset."""

from dataclasses import asdict

from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.commands.shared.machine import print_json
from nanoslip.study.dataset.variables import Described, described, rows, text_of
from nanoslip.study.report.console import Table, print_sentences, print_table


def work(name: str | None, as_json: bool) -> None:
    """Print what one variable of a dataset is, or a table of all."""
    found = rows() if name is None else [_described(name)]
    if as_json:
        print_json([asdict(one) for one in found])
    elif name is None:
        cells = tuple((one.name, one.units, one.meaning) for one in found)
        print_table(Table(("variable", "unit", "meaning"), cells, prose=True))
    else:
        print_sentences(text_of(found[0]).splitlines())


def _described(name: str) -> Described:
    try:
        return described(name)
    except KeyError as error:
        raise Refusal(error.args[0]) from None
