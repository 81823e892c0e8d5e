"""Check the tables of a campaign file and the files that it names: known words, values in range, declared types."""

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from nanoslip.solver.case import Case
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.parameter import declared
from nanoslip.solver.slab import SCHEMES
from nanoslip.study.manifest.columns import (
    Columns,
    Given,
    ManifestError,
    PinProfile,
    Table,
    key_shown,
    need,
    read_profile,
    read_table,
    read_text,
    shown,
    unknown,
)
from nanoslip.study.manifest.parameters import Alike, Value, make_case, words, words_of


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


# Read the files that a campaign names: its table of cases, the pin's roughness, a measured front.

Content = TypeVar("Content")


class NamedFiles(Checker):
    """Reads the files that one campaign file names, or takes their texts from `beside`; collects problems."""

    def table(self, top: dict[str, Any]) -> Table | None:
        """The table of cases; None where the campaign names none or it is refused."""
        if "table" not in top:
            return None
        for other in ("axes", "design"):
            if other in top:
                self.refuse(other, f"needs to be left out beside table = {shown(top['table'])}")
        return self._read(read_table, "table", top["table"])

    def profile(self, content: dict[str, Any]) -> PinProfile | None:
        """The pin's roughness; None where the table [heterogeneity] names none or it is refused."""
        name = content.get("roughness")
        if name is None:
            return None
        if not isinstance(name, str):
            self.refuse(f"heterogeneity.roughness = {shown(name)}", "needs the path of a CSV file with xi and height")
            return None
        return self._read(read_profile, "roughness", name)

    def measured(self, key: str, content: dict[str, Any]) -> str | None:
        """The text of a measured front; None where the campaign names none or it is refused."""
        found = self._read(read_text, key, content[key]) if key in content else None
        return found[1] if found else None

    def _read(self, read: Callable[[Path, str | None], Content], key: str, name: str) -> Content | None:
        """What is in the file that a key names, or in its text; None where that is refused."""
        if self.beside is not None and key not in self.beside:
            self.refuse(key, "the text of its file is missing")
            return None
        try:
            return read(self.path.parent / name, self.beside[key] if self.beside is not None else None)
        except ManifestError as error:
            self.problems += error.lines
            return None
