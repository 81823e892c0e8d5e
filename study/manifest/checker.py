"""The tables of a campaign file against the parameters that there are: known words, values in their declared type."""

from collections.abc import Callable, Collection, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from solver.slab import SCHEMES
from study.manifest.columns import Columns, Given
from study.manifest.parameters import Value, make_case, words, words_of
from study.manifest.problems import key_shown, need, shown, unknown


class Checker:
    """Checks the tables of one campaign file, gathering its problems."""

    def __init__(self, path: Path, beside: Mapping[str, str] | None = None) -> None:
        self.path = path
        self.beside = beside
        self.problems: list[str] = []

    def refuse(self, where: str, wrong: str) -> None:
        self.problems.append(f"{self.path}: {where}: {wrong}")

    def words_of_table(self, table: str, content: dict[str, Any]) -> Columns:
        """The known words of a table of parameters, each a column of one."""
        good: Columns = {}
        for word, value in content.items():
            if word in words_of(table):
                good[word] = [Given(f"{self.path}: {table}.{word}", value)]
            else:
                self.refuse(f"{table}.{key_shown(word)} = {shown(value)}", unknown(word, words_of(table)))
        return good

    def one_place(self, axes: Columns, fixed: dict[str, Columns]) -> None:
        for table, part in fixed.items():
            for word in part:
                if word in axes:
                    self.refuse(f"{table}.{word}", "is an axis too: needs one place")

    def values(self, columns: Columns, slabs: list[dict[str, Value]]) -> dict[str, tuple[Any, ...]]:
        """Values in their declared type by field name; those that fit none of the slabs are refused and left out.

        None stands for a setting that a line of a table does not give.
        """
        values: dict[str, tuple[Any, ...]] = {}
        for word, given in columns.items():
            name = words()[word]
            taken: list[Any] = []
            for where, value in given:
                if value is None:
                    taken.append(None)
                    continue
                points = [{**slab, name: value} for slab in slabs] if name in SCHEMES.settings() else [{name: value}]
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
        """The keys of a table that are among `names` and whose value `make` takes, beside `others`."""
        good = {}
        for key, value in content.items():
            if key not in names:
                self.refuse(f"{where}.{key_shown(key)} = {shown(value)}", unknown(key, names))
            elif wrong := need(partial(make, **{**others, key: value})):
                self.refuse(f"{where}.{key} = {shown(value)}", wrong)
            else:
                good[key] = value
        return good
