"""Pages that follow from declarations: every key of a campaign, every variable of a dataset, every name of the Python API."""

import inspect
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, fields
from pathlib import Path
from typing import Any, get_type_hints

import nanoslip
from nanoslip.solver.case import PARTS, Case
from nanoslip.solver.drive import INTEGRATORS, Drive, Scales
from nanoslip.solver.parameter import MOST_WHOLE, Parameter, choices_of, declared
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.solver.sliding.sizes import SIZES
from nanoslip.solver.sliding.validity import FLAGS
from nanoslip.study.dataset.variables import Described, rows
from nanoslip.study.manifest.manifest import NamedDrive
from nanoslip.study.manifest.parameters import LIMITS, TABLES

Row = tuple[str, ...]


def table(head: Row, body: Iterable[Row]) -> str:
    """A table in Markdown."""
    lines = (head, ("---",) * len(head), *body)
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


# Keys of a campaign.

HEAD = ("key", "meaning", "unit", "allowed", "default")
FAMILIES = {"scheme": SCHEMES, "integrator": INTEGRATORS}


def keys(kinds: Iterable[type], within: str | None = None) -> Iterator[Row]:
    """The rows of all parameters that these types declare, of one table of a campaign or of all."""
    for kind in kinds:
        types = get_type_hints(kind)
        defaults = {each.name: each.default for each in fields(kind)}
        for name, stated in declared(kind).items():
            if within in (None, stated.table):
                key, text, *rest, default = _key(name, stated, types[name], defaults[name])
                member = next((word for family in FAMILIES.values() for word, own in family.items() if own is kind), "")
                if member in SCHEMES and default == "none":
                    default = f"`{Slab(scheme=member).flat[name]}` at n_x = 129"
                if stated.table == "limits":
                    default = f"`{LIMITS[name]:g}` without any limit" if name in LIMITS else "none"
                yield key, f"`{member}`: {text}" if member else text, *rest, default


def _key(name: str, stated: Parameter, kind: Any, default: Any) -> Row:
    word = stated.word or name
    meaning = stated.meaning + (f" ({stated.symbol})" if stated.symbol else "")
    text = f"{meaning}; {stated.comment}" if stated.comment else meaning
    allowed = stated.allowed(word, kind is int or int in getattr(kind, "__args__", ())).replace(name, word)
    allowed = allowed.replace(str(MOST_WHOLE), "2^63 - 1").removeprefix(f"{word} ≥ -inf")
    words = FAMILIES[name].keys() if name in FAMILIES else choices_of(kind)
    if words:
        allowed = ", ".join(f'`"{each}"`' for each in words)
    elif stated.columns:
        allowed = f"a CSV file with the columns {', '.join(stated.columns)}"
    elif kind is bool:
        allowed = "`true`, `false`"
    return f"`{word}`", text, "" if stated.unit == "1" else stated.unit, allowed, _default(stated, default)


def _default(stated: Parameter, default: Any) -> str:
    value = stated.si if default is MISSING else default
    match value:
        case None | () | float("inf"):
            return "none"
        case bool():
            return f"`{str(value).lower()}`"
        case str():
            return f'`"{value}"`'
    return f"`{value:g}`" if isinstance(value, float) else f"`{value}`"


def tables_of_keys() -> Iterator[tuple[str, str]]:
    """Name of a table of a campaign -> its keys, as Markdown."""
    for name in TABLES:
        yield name, table(HEAD, keys((Case, Slab, *SCHEMES.values(), *PARTS.values()), name))
    yield "scales", table(HEAD, keys((Scales,)))
    yield "drives", table(HEAD, keys((NamedDrive, Drive, *INTEGRATORS.values())))


# Variables of a dataset.

SIZE = "SIZE"
"""What stands for each of SIZES, by which the names of variables begin."""


def variables() -> str:
    """All variables, a section for each group; those that differ only by the size of an event are one row."""
    sections: dict[str, list[Row]] = {}
    for each in rows():
        sections.setdefault(each.group, []).append(_variable(each))
    parts = [f"{SIZE} is one of " + ", ".join(f"`{word}` ({meaning})" for word, meaning in SIZES.items()) + "."]
    for group, body in sections.items():
        parts.append(f"## {group[0].upper()}{group[1:]}")
        parts.append(table(("variable", "along", "unit", "meaning", "remark"), _folded(body)))
    return "\n\n".join(parts) + "\n"


def _folded(body: Iterable[Row]) -> Iterable[Row]:
    marked = {row: _marked(row) for row in body}
    alike = Counter(marked.values())
    return dict.fromkeys(new if alike[new] == len(SIZES) else row for row, new in marked.items())


def _marked(row: Row) -> Row:
    """A row with SIZE for the size that its name begins with, and for that one's unit."""
    word = next((word for word in SIZES if row[0].startswith(f"`{word}_")), None)
    if word is None:
        return row
    name, along, unit, *texts = (cell.replace(SIZES[word], SIZE).replace(word, SIZE) for cell in row)
    return name, along, unit and f"that of {SIZE}", *texts


def _variable(each: Described) -> Row:
    meaning = each.meaning + (f" ({each.symbol})" if each.symbol else "")
    values = ", ".join(f"`{value}`" for value in each.values)
    remark = "; ".join(filter(None, (values, each.comment, "has a ±" if each.uncertainty else "")))
    return f"`{each.name}`", each.dims, each.units, meaning, remark


def flags() -> str:
    """The validity flags."""
    body = ((f"`{each.name}`", str(each.mask), each.meaning, each.advice) for each in FLAGS)
    return table(("flag", "bit", "meaning", "what to do"), body)


# Names of the Python API.


def names() -> str:
    """Directives for every public name, by its kind."""
    groups: Mapping[str, list[str]] = {"Functions": [], "Values": [], "Errors": []}
    for name in nanoslip.__all__:
        value = getattr(nanoslip, name)
        if not inspect.isclass(value):
            groups["Functions"].append(f".. autofunction:: nanoslip.{name}")
        elif issubclass(value, Exception):
            groups["Errors"].append(f".. autoexception:: nanoslip.{name}")
        else:
            groups["Values"].append(f".. autoclass:: nanoslip.{name}\n   :members:")
    parts = [f"{title}\n{'-' * len(title)}\n\n" + "\n\n".join(lines) for title, lines in groups.items()]
    return "\n\n".join(parts) + "\n"


def write(folder: Path) -> None:
    """Write what the pages include."""
    folder.mkdir(exist_ok=True)
    texts = {f"keys_{name}.md": text for name, text in tables_of_keys()}
    texts |= {"variables.md": variables(), "flags.md": flags(), "names.rst": names()}
    for name, text in texts.items():
        (folder / name).write_text(text, "utf-8")
