"""Every variable that a dataset can have, from the declarations: rows, one variable in full, and a page of all of them.

`python -m nanoslip.study.dataset.description > campaigns/variables.md` writes the page.
"""

import difflib
import sys
import textwrap
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

from nanoslip.solver.parameter import Quantity
from nanoslip.solver.sliding.sizes import SIZES
from nanoslip.study.dataset.variables import (
    ADVICE,
    CASE_ID,
    COMPUTED_BY,
    DISCRETIZATION_ERROR,
    DRIVE,
    DRIVE_MEMBERS,
    DRIVE_NAME,
    EVENT_DROP,
    MEMBERS,
    OUTCOMES,
    SOFTWARE,
    all_groups,
    companions,
    parameters,
    scalars,
)
from nanoslip.study.plan.tasks import KINDS

CASES = "cases"
"""What stands for the dimensions that the cases lie along."""
WIDTH = 140
"""Characters of a line of the page that is no row of a table."""


@dataclass(frozen=True, slots=True)
class Described:
    """One variable of a dataset."""

    name: str
    group: str
    """What it is part of."""
    dims: str
    """What it lies along; `cases` are the dimensions of the cases."""
    units: str
    meaning: str
    """Short enough for the label of an axis."""
    symbol: str
    """What it is called in equations; empty where it has no name there."""
    uncertainty: str
    """The variable that says how uncertain this one is; empty where none does."""
    comment: str
    values: tuple[str, ...]
    """Names of its bits, meanings of its numbers from 0 on, or the texts that it can hold; empty where it is any number."""


def rows() -> list[Described]:
    """All variables, group by group, each name once in the root and once in each group."""
    found: dict[tuple[str, str], Described] = {}
    for each in _all():  # the root is one group
        found.setdefault((each.group if each.group.startswith(_GROUP) else "", each.name), each)
    return list(found.values())


def described(name: str) -> Described:
    """One variable, those beside means included.

    Raises KeyError that names the nearest ones, or those of this symbol, where there is none of this name.
    """
    found = next((each for each in _all(beside=True) if each.name == name), None)
    if found is None:
        called = list(dict.fromkeys(each.name for each in rows() if each.symbol == name))
        near = called or difflib.get_close_matches(name, {each.name: each for each in rows()}, n=3, cutoff=0.5)
        raise KeyError(f"{name}: no variable of a dataset" + (f"; nearest: {', '.join(near)}" if near else ""))
    return found


def text_of(variable: Described) -> str:
    """All that is known of a variable, line by line."""
    facts = {
        "meaning": variable.meaning,
        "symbol": variable.symbol,
        "along": variable.dims,
        "unit": variable.units,
        "uncertainty": variable.uncertainty,
        "values": ", ".join(variable.values),
        "comment": variable.comment,
        "part of": variable.group,
    }
    return "\n".join([variable.name, *(f"  {what}: {text}" for what, text in facts.items() if text)])


def page() -> str:
    """All variables as Markdown: a section for each group, those that differ in one word as one row."""
    sections: dict[str, list[Described]] = {}
    for each in rows():
        sections.setdefault(each.group, []).append(each)
    lines = [_HEAD, "", "| section | variables |", "|---|---|"]
    lines += [f"| [{_title(group)}](#{_anchor(group)}) | {len(found)} |" for group, found in sections.items()]
    for group, found in sections.items():
        family = _FAMILIES.get(group)
        lines += [f"\n## {_title(group)}\n", *(family.lines if family else ())]
        lines += [*_COLUMNS, *map(_line, family.folded(found) if family else found)]
    return "\n".join(lines) + "\n"


def _title(group: str) -> str:
    return f"{group[0].upper()}{group[1:]}"


def _anchor(group: str) -> str:
    return group.replace(" ", "-")


@dataclass(frozen=True, slots=True)
class _Family:
    """Variables that there is one of for each of several words, which their names begin with."""

    mark: str
    """What stands for the word."""
    words: Mapping[str, str]
    """Word -> what it stands for in sentences."""

    @property
    def lines(self) -> list[str]:
        named = ", ".join(f"`{word}` ({meaning})" for word, meaning in self.words.items())
        return [*textwrap.wrap(f"{self.mark} is one of {named}.", WIDTH, break_on_hyphens=False), ""]

    def folded(self, found: Iterable[Described]) -> list[Described]:
        """Variables that differ only by a word of the family are folded into one; the others stay as they are."""
        marked = {each: self._marked(each) for each in found}
        units: dict[Described, list[str]] = {}
        for new in marked.values():
            units.setdefault(replace(new, units=""), []).append(new.units)
        rows = (self._one(each, new, units[replace(new, units="")]) for each, new in marked.items())
        return list(dict.fromkeys(rows))

    def _one(self, each: Described, new: Described, units: list[str]) -> Described:
        """The row of those that are alike but for their word and perhaps their units, or of one that is not."""
        if len(units) < len(self.words):
            return each
        return new if len(set(units)) == 1 else replace(new, units=f"that of {self.mark}")

    def _marked(self, each: Described) -> Described:
        word = next((word for word in self.words if each.name.startswith(f"{word}_")), None)
        if word is None:
            return each
        texts = (each.name, each.uncertainty, each.meaning, each.comment)
        name, uncertainty, meaning, comment = (
            text.replace(self.words[word], self.mark).replace(word, self.mark) for text in texts
        )
        return replace(each, name=name, uncertainty=uncertainty, meaning=meaning, comment=comment)


_FAMILIES = {
    "statistics": _Family("SIZE", SIZES),
}
"""Sections whose rows are folded."""

_HEAD = """# Variables of a dataset

What `results.nc` can hold; which of it a campaign has follows from its stages and outputs. Lengths are in slab widths L_x,
forces over the load W, stiffness in G·L_y, where no SI unit is given. `cases` stands for the dimensions of the cases:
`intrinsic_friction`, `radius`, `aspect_ratio`, `n_x` and every further axis, or `case`; `drive` is a dimension where there are
several drives. Numbers are means over the members of each case's ensemble; beside many stand `NAME_uncertainty`, their
[±](../README.md#uncertainty), and `NAME_members`, how many members have a value. The root of the file has scalars and
parameters; records, trajectories, contacts, the inside of slabs and the software are groups of their own.
`nanoslip describe NAME` says the same of one variable. This page is written by `python -m nanoslip.study.dataset.description`."""


_COLUMNS = ("| variable | along | unit | meaning | symbol | uncertainty | remark |", "|---|---|---|---|---|---|---|")


def _line(variable: Described) -> str:
    values = ", ".join(f"`{value}`" for value in variable.values)
    remark = "; ".join(part for part in (values, variable.comment) if part)
    error = f"`{variable.uncertainty}`" if variable.uncertainty else ""
    cells = (f"`{variable.name}`", variable.dims, variable.units, variable.meaning, variable.symbol, error, remark)
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"


def _all(beside: bool = False) -> Iterator[Described]:
    """Those of all groups. beside: with the ± and the counts of members that stand beside means."""
    ending, message = OUTCOMES[""]
    own = (CASE_ID, ending, message, COMPUTED_BY[""], DISCRETIZATION_ERROR, ADVICE, MEMBERS)
    yield from _of("the case", CASES, own)
    for kind in KINDS:
        head = (*OUTCOMES[DRIVE], COMPUTED_BY[DRIVE], DRIVE_MEMBERS) if kind == DRIVE else ()
        dims = f"{CASES}, drive" if kind == DRIVE else CASES
        own = (*head, *scalars(kind).values(), *companions(kind).values())
        around = [part for each in own for part in (each, *each.beside)] if beside else own
        yield from _of(_GROUPS.get(kind, kind), dims, around)
    for group in all_groups().values():
        yield from _of("the runs of a case", f"{CASES}, drive" if group.driven else CASES, (group.id,))
    yield from _of("parameters", "where they vary", (DRIVE_NAME, *parameters().values()))
    for group in all_groups().values():
        counts = [series[0].count for series in group.samples.values()]
        yield from _of(f"{_GROUP}{group.name}", group.name, (group.label, *group.owners, *counts))
        for sample in group.samples:
            columns = [each for each in group.columns.values() if each.along == sample]
            made = [EVENT_DROP] if sample == EVENT_DROP.along else []
            yield from _of(f"{_GROUP}{group.name}", sample, [*columns, *made])
    yield from _of(f"{_GROUP}{SOFTWARE[0].name}", SOFTWARE[0].name, SOFTWARE)


_GROUPS = {"contact": "initial contact", "record": "the friction record", DRIVE: "the drive"}
"""Kind of task -> what its variables are about."""
_GROUP = "group "
"""What the titles of groups beside the root begin with."""


def _of(group: str, dims: str, quantities: Iterable[Quantity]) -> Iterator[Described]:
    for each in quantities:
        values = tuple(filter(None, each.flags)) or each.codes or each.words
        facts = ("" if each.words else each.units, each.long_name, each.symbol, each.uncertainty, each.comment, values)
        yield Described(each.name, group, dims, *facts)


if __name__ == "__main__":
    sys.stdout.write(page())
