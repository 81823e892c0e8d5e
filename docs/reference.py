"""Tables that follow from declarations: every key of a campaign, every variable of a dataset, every name of the Python API.

`python docs/reference.py` writes them into the pages that show them.
"""

import inspect
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import nanoslip
from nanoslip.solver.parameter import measure_label
from nanoslip.solver.sliding.sizes import SIZES
from nanoslip.solver.sliding.validity import FLAGS
from nanoslip.study.dataset.variables import Described, rows
from nanoslip.study.manifest.keys import TYPES_OF_TABLE, Key, keys

Row = tuple[str, ...]


def table(head: Row, body: Iterable[Row]) -> str:
    """A table in Markdown."""
    lines = (head, ("---",) * len(head), *body)
    return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines)


# Keys of a campaign.

HEAD = ("key", "meaning", "allowed", "default")


def tables_of_keys() -> Iterator[tuple[str, str]]:
    """Name of a table of a campaign -> its keys, as Markdown."""
    for name in filter(None, TYPES_OF_TABLE):
        yield name, table(HEAD, (_key(key) for key in keys() if key.table == name))


def _key(key: Key) -> Row:
    stated = key.stated
    meaning = f"`{key.only}`: {stated.long_name}" if key.only else stated.long_name
    meaning += f" ({stated.symbol})" * bool(stated.symbol) + f"; {stated.comment}" * bool(stated.comment)
    meaning += f" [{stated.unit}]" * (stated.unit not in ("", "1"))
    default = key.default if key.default in ("none", "needed") else f"`{key.default}` {key.unless}".strip()
    return f"`{key.word}`", meaning, re.sub(r'"\w+"|\btrue\b|\bfalse\b', r"`\g<0>`", key.allowed), default


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
        parts.append(table(("variable", "meaning", "unit", "along", "remark"), _folded(body)))
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
    name, meaning, unit, *rest = (cell.replace(SIZES[word], SIZE).replace(word, SIZE) for cell in row)
    return name, meaning, unit and f"that of {SIZE}", *rest


def _variable(each: Described) -> Row:
    meaning = measure_label(each.meaning, each.measure) + (f" ({each.symbol})" if each.symbol else "")
    values = ", ".join(f"`{value}`" for value in each.values)
    remark = "; ".join(filter(None, (values, each.comment, "has a ±" if each.uncertainty else "")))
    return f"`{each.name}`", meaning, each.units, each.dims, remark


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


# Where they are shown.

HERE = Path(__file__).parent
SHOWN = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end of table -->)", re.DOTALL)
"""A table in a page, between its name and its end: a visitor of the repository sees what the site shows."""


def tables() -> dict[str, str]:
    """Name of a table that pages show -> its Markdown."""
    return {f"keys_{name}": text for name, text in tables_of_keys()} | {"variables": variables(), "flags": flags()}


def filled_pages() -> Iterator[tuple[Path, str]]:
    """Each page that shows tables, with the text that it should have."""
    known = tables()
    for page in sorted(HERE.glob("*.md")):
        text = page.read_text("utf-8")
        if SHOWN.search(text):
            yield page, SHOWN.sub(lambda shown: f"{shown[1]}\n{known[shown[2]].strip()}\n\n{shown[3]}", text)


def write(folder: Path) -> None:
    """Write the names of the Python API, which the site includes, and the tables in pages."""
    folder.mkdir(exist_ok=True)
    (folder / "names.rst").write_text(names(), "utf-8")
    for page, text in filled_pages():
        if page.read_text("utf-8") != text:
            page.write_text(text, "utf-8")


if __name__ == "__main__":
    write(HERE / "generated")
