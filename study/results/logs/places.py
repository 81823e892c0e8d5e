"""Where results are in logs, and what they say of themselves. Of millions of them little is kept: numbers, in columns."""

from array import array
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TypeVar

from study.results.entry import Head, Meta
from study.results.logs.log import Place

Value = TypeVar("Value", Meta, Path)
Said = TypeVar("Said")


class Places(Mapping[str, Place]):
    """Key -> where its result is."""

    def __init__(self) -> None:
        self._rows: dict[str, int] = {}
        self._metas: list[Meta] = []
        self._paths: list[Path] = []
        self._known: dict[int, int] = {}
        self._meta, self._path, self._table, self._checksum, self._seal = (array("I") for _ in range(5))
        self._numbers, self._length, self._begin = (array("Q") for _ in range(3))

    def add(self, place: Place) -> None:
        """Enter a result; of two with the same key the one that is entered later stays."""
        head, path, begin = place
        self._rows[head.key] = len(self._begin)
        self._meta.append(self._number(head.meta, self._metas))
        self._path.append(self._number(path, self._paths))
        self._table.append(head.table)
        self._numbers.append(head.numbers)
        self._checksum.append(head.checksum)
        self._seal.append(head.seal)
        self._length.append(head.length)
        self._begin.append(begin)

    def forget(self, key: str) -> None:
        """Leave out a result, where there is one."""
        self._rows.pop(key, None)

    def forget_all(self, path: Path) -> None:
        """Leave out what is in this log."""
        gone = {number for number, each in enumerate(self._paths) if each == path}
        self._rows = {key: row for key, row in self._rows.items() if self._path[row] not in gone}

    def path(self, key: str) -> Path:
        """The log that a result is in."""
        return self._paths[self._path[self._rows[key]]]

    def meta(self, key: str) -> Meta:
        """What a result says of itself."""
        return self._metas[self._meta[self._rows[key]]]

    def of_all(self, what: Callable[[Meta], Said]) -> dict[str, Said]:
        """Something that every result says of itself."""
        said = list(map(what, self._metas))
        return {key: said[self._meta[row]] for key, row in self._rows.items()}

    def seal(self, key: str) -> int:
        """The seal of a result."""
        return self._seal[self._rows[key]]

    def __getitem__(self, key: str) -> Place:
        row = self._rows[key]
        head = Head(
            key,
            self._metas[self._meta[row]],
            self._table[row],
            self._numbers[row],
            self._checksum[row],
            self._seal[row],
            self._length[row],
        )
        return Place(head, self._paths[self._path[row]], self._begin[row])

    def __contains__(self, key: object) -> bool:
        return key in self._rows

    def __iter__(self) -> Iterator[str]:
        return iter(self._rows)

    def __len__(self) -> int:
        return len(self._rows)

    def _number(self, value: Value, values: list[Value]) -> int:
        """The number of one of few objects, which are told apart by where they are: their hash takes longer."""
        number = self._known.get(id(value))
        if number is None:
            self._known[id(value)] = number = len(values)
            values.append(value)
        return number
