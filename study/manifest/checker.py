"""Check the tables of a campaign file: known words only, values in range and converted to their declared type."""

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from solver.case import Case
from solver.outcome import InvalidInput
from solver.parameter import declared
from solver.slab import SCHEMES
from study.manifest.columns import Columns, Given
from study.manifest.parameters import Alike, Value, make_case, words, words_of
from study.manifest.problems import key_shown, need, shown, unknown


class Checker:
    """Checks the tables of one campaign file and collects its problems, one line each.

    beside: texts of the files that the campaign names, by their keys; None where they are read from disk.
    """

    def __init__(self, path: Path, beside: Mapping[str, str] | None = None) -> None:
        self.path = path
        self.beside = beside
        self.problems: list[str] = []

    def refuse(self, where: str, wrong: str) -> None:
        """Add a problem: the key and value that are refused, and what is needed instead."""
        self.problems.append(f"{self.path}: {where}: {wrong}")

    def words_of_table(self, table: str, content: dict[str, Any], others: Collection[str] = ()) -> Columns:
        """The entries of a table of parameters, each as a column with one value. Unknown words are refused.

        others: what the table takes beside parameters, for the advice.
        """
        good: Columns = {}
        for word, value in content.items():
            if word in words_of(table):
                good[word] = [Given(f"{self.path}: {table}.{word}", value)]
            else:
                self.refuse(f"{table}.{key_shown(word)} = {shown(value)}", unknown(word, (*words_of(table), *others)))
        return good

    def lists(self, table: str, content: Mapping[str, Any], known: Collection[str]) -> Iterator[tuple[str, list[Any]]]:
        """The axes of a table, with their values. Unknown words are refused, and what is no list of values."""
        for word, values in content.items():
            if word in known and isinstance(values, list) and values:
                yield word, values
            else:
                wrong = "needs a list of at least one value" if word in known else unknown(word, known)
                self.refuse(f"{table}.{key_shown(word)} = {shown(values)}", wrong)

    def one_place(self, axes: Columns, fixed: dict[str, Columns]) -> None:
        """Refuse every parameter that is given twice: as an axis and in a table."""
        for table, part in fixed.items():
            for word in part:
                if word in axes:
                    self.refuse(f"{table}.{word}", "is an axis too: needs one place")

    def values(self, columns: Columns, slabs: list[dict[str, Value]]) -> dict[str, tuple[Any, ...]]:
        """Values in their declared type, by field name. Values out of range are refused and left out.

        slabs: parameters of the campaign's slabs. A setting of a scheme, or an n_x, is refused only if it fits none of them.
            None stands for a setting that a line of a table does not give.
        """
        values: dict[str, tuple[Any, ...]] = {}
        for word, given in columns.items():
            name = words()[word]
            taken: list[Any] = []
            quick = _quick(name)
            for where, value in given:
                if value is None:
                    taken.append(None)
                    continue
                if quick and (case := quick(value)):
                    taken.append(getattr(case, name))
                    continue
                of_slabs = name == "n_x" or name in SCHEMES.settings()
                points = [{**slab, name: value} for slab in slabs] if of_slabs else [{name: value}]
                wrong = {index: need(make_case, point) for index, point in enumerate(points)}
                fitting = [point for index, point in enumerate(points) if not wrong[index]]
                if fitting:
                    taken.append(make_case(fitting[0]).flat[name])
                else:
                    self.problems.append(f"{where} = {shown(value)}: {list(wrong.values())[-1]}")
            values[name] = tuple(taken)
        return values

    def checked(
        self, where: str, content: dict[str, Any], make: Callable[..., object], names: Collection[str], **others: object
    ) -> dict[str, Any]:
        """The entries of a table that pass: the key is among `names`, and `make` takes the value together with `others`.

        All other entries are refused.
        """
        good = {}
        for key, value in content.items():
            if key not in names:
                self.refuse(f"{where}.{key_shown(key)} = {shown(value)}", unknown(key, names))
            elif wrong := need(partial(make, **{**others, key: value})):
                self.refuse(f"{where}.{key} = {shown(value)}", wrong)
            else:
                good[key] = value
        return good


def _quick(name: str) -> Callable[[Any], Case | None] | None:
    """What makes a case with a value of a case's own parameter; None for other parameters, and of a value that is refused.

    A table has millions of values.
    """
    if name not in declared(Case):
        return None
    alike = Alike({}, (name,))

    def made(value: Any) -> Case | None:
        try:
            return alike.case((value,))
        except InvalidInput:
            return None  # is looked at more closely

    return made
