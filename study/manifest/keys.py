"""Every key of a campaign that a parameter declares: meaning, unit, allowed values, default and an example."""

import json
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from typing import Any, Final, get_type_hints

from nanoslip.solver.case import PARTS, Case
from nanoslip.solver.drive import AUTO, INTEGRATORS, Drive, Scales
from nanoslip.solver.parameter import Parameter, declared, field_choices
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.study.manifest import manifest
from nanoslip.study.manifest.parameters import LIMITS, TABLES, UNITS, as_written, axes, compact, with_symbol

CASE_TYPES: Final = (Case, Slab, *SCHEMES.values(), *PARTS.values())
TYPES_OF_TABLE: Final = {
    **dict.fromkeys(TABLES, CASE_TYPES),
    "scales": (Scales,),
    "drives": (manifest.NamedDrive, Drive, *INTEGRATORS.values()),
    "ensemble": (manifest.EnsembleTable,),
    "target": (manifest.TargetTable,),
    "outputs": (manifest.Outputs,),
    "about": (manifest.About,),
    "": (manifest.CampaignKeys,),
}
"""Table of a campaign -> types that declare its keys; empty: outside of all tables."""
FAMILIES: Final[Mapping[str, Mapping[str, Any]]] = {"scheme": SCHEMES, "integrator": INTEGRATORS}


@dataclass(frozen=True, slots=True)
class Key:
    """One key of a campaign, in words."""

    word: str
    name: str
    """Field of the parameter, and variable of a dataset."""
    table: str
    only: str
    """The scheme or integrator that it belongs to; empty for all."""
    stated: Parameter
    allowed: str
    default: str
    """Text of its value; `none` without one, `needed` of a key that has to be given."""
    unless: str = ""
    """Condition of the default."""

    @property
    def place(self) -> str:
        """Table and word in a campaign."""
        brackets = "[[{}]] " if self.table == "drives" else "[{}] "
        table = brackets.format(self.table) if self.table else ""
        condition = f", with {self.only}" if self.only else ""
        return f"{table}{self.word}{condition}"

    @property
    def example(self) -> str:
        """The default as a line of a campaign, and with a unit; empty without a default."""
        if self.stated.columns:
            line = f'{self.word} = "mine.csv"'
            if self.word == "roughness":
                line += f', or {self.word} = {{file = "afm.csv", x = "um", z = "nm"}}'
            return line
        value, unit = self.default, _unit(self)
        if value in ("none", "needed"):
            return ""
        if not unit or value.startswith('"'):
            return f"{self.word} = {value}"
        # A number without a unit of its own is a multiple of a scale, which its default has in SI.
        is_multiple = self.stated.unit == "1"
        scale = getattr(Scales(), self.stated.scale) if is_multiple else 1.0
        quantity = compact(float(value) * scale, unit)
        line = f'{self.word} = {value}, or {self.word} = "{quantity}"'
        if is_multiple and self.stated.scale == "slab_width":
            line += "  # beside a slab_width"
        return line


def _unit(key: Key) -> str:
    stated = key.stated
    if stated.unit != "1":
        return as_written(stated.unit)
    return UNITS.get(stated.scale, "")


def find_key(name: str) -> Key | None:
    """The key of this word, name or symbol, in Greek or Latin letters; None without one."""
    matches = [key for key in keys() if name in (key.word, key.name)]
    if matches:
        return matches[0]
    symbols = {key: key.stated.symbol for key in keys()}
    return next(iter(with_symbol(name, symbols)), None)


def key_text(key: Key) -> str:
    """A key in full, line by line."""
    stated = key.stated
    facts = {
        "meaning": stated.long_name,
        "symbol": stated.symbol,
        "unit": stated.unit,
        "key": key.place,
        "allowed": key.allowed,
        "default": f"{key.default} {key.unless}".strip(),
        "example": key.example,
        "comment": stated.comment,
    }
    lines = [f"  {fact}: {text}" for fact, text in facts.items() if text]
    return "\n".join([key.word, *lines])


def text_of_table(name: str) -> str:
    """A table of a campaign, with the meaning or default of each key, line by line; empty without one of this
    name."""
    name = name.strip("[]")
    table = "drives" if name == "drive_axes" else name
    # An axis takes keys of many tables. Keys outside of all tables have the table "": no name means none of them.
    if table == "axes":
        entries = [key for key in keys() if key.word in axes()]
    else:
        entries = [key for key in keys() if table and key.table == table]
    if not entries:
        return ""
    lines = [f"{key.word}: {key.stated.long_name}" for key in entries]
    return "\n  ".join([f"[{name}]", *lines])


@cache
def keys() -> tuple[Key, ...]:
    """All keys, table by table, in the order of declaration."""
    return tuple(_keys())


def _keys() -> Iterator[Key]:
    for table, kinds in TYPES_OF_TABLE.items():
        for kind in kinds:
            types, defaults = get_type_hints(kind), {item.name: item.default for item in fields(kind)}
            for name, stated in declared(kind).items():
                # The parts of a case are entered for each of its tables; each parameter says in which one it is.
                if table not in TABLES or stated.table == table:
                    yield _key(kind, name, table, stated, types[name], defaults[name])
    for (table, word), stated in manifest.MORE_KEYS.items():
        allowed = stated.describe_range(word, whole=False)
        yield Key(word, word, table, "", stated, allowed, "none")


def _key(kind: type, name: str, table: str, stated: Parameter, hint: Any, value: Any) -> Key:
    word = stated.word or name
    # The solver's own drive has no defaults, as its units depend on the scales: those of a campaign are in SI.
    if value is MISSING and table in ("scales", "drives"):
        value = stated.si
    members = (member for family in FAMILIES.values() for member, its_type in family.items() if its_type is kind)
    only = next(members, "")
    default, unless = "needed" if value is MISSING else _text(value), ""
    if name == "duration":
        default = f'"{AUTO}"'
    # A setting of None follows from the grid: the one of the default slab stands for it.
    if only in SCHEMES and default == "none":
        slab = Slab(scheme=only)
        default, unless = _text(slab.flat[name]), "at n_x = 129"
    # A case has no limit by default; a campaign has, where its file gives none.
    if table == "limits":
        default = "none"
        if name in LIMITS:
            default, unless = f"{LIMITS[name]:g}", "without any limit"
    allowed = _need(name, word, stated, hint)
    return Key(word, name, table, only, stated, allowed, default, unless)


def _need(name: str, word: str, stated: Parameter, hint: Any) -> str:
    if stated.need and not stated.columns:
        return stated.need
    words = FAMILIES[name].keys() if name in FAMILIES else field_choices(hint)
    if words:
        return ", ".join(f'"{choice}"' for choice in words)
    if stated.columns:
        columns = ", ".join(stated.columns)
        return f"a CSV file with the columns {columns}"
    if hint is bool:
        return "true, false"
    # `int | None` is a whole number, too.
    is_whole = hint is int or int in getattr(hint, "__args__", ())
    return stated.describe_range(word, is_whole)


def _text(value: Any) -> str:
    match value:
        case None | () | "" | float("inf"):
            return "none"
        case tuple():
            return json.dumps(value)
        case bool():
            return str(value).lower()
        case str():
            return f'"{value}"'
        case float():
            return f"{value:g}"
    return str(value)
