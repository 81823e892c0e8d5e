"""Change datasets in every way that their format allows, with a right checksum, and read them with all commands that do:
`python -m tests.study.results.hostile`.

A command must end with one message or a page, whatever a dataset says: no traceback, no warning of a library.
"""

import argparse
import copy
import random
import shutil
import sys
import traceback
import warnings
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final
from unittest.mock import patch

import netCDF4
import numpy as np

from nanoslip.study.commands import cli
from nanoslip.study.commands.datasets import write_dataset
from nanoslip.study.dataset.file import FILE, check_seal, seal
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.results.store import Store
from nanoslip.study.run.launch import pin_arithmetic
from tests.study.dataset.campaigns import compute

CAMPAIGN: Final = """\
title = "A dataset that somebody changed"
stages = ["contact", "slip", "dynamics"]
axes.intrinsic_friction = [0.3, 0.5]
axes.radius = [60.0, 100.0]
numerics.n_x = 17
limits.events = 200
ensemble.members = 2
outputs.tractions = true

[[drives]]
name = "slow"
stage_velocity = 1e-3
samples = 10
"""


@dataclass
class Variable:
    """A variable of a dataset: its dimensions, values as stored, and attributes."""

    dims: tuple[str, ...]
    values: Any
    attributes: dict[str, Any]


@dataclass
class Group:
    """A group of a dataset, with those in it."""

    dims: dict[str, int]
    variables: dict[str, Variable]
    attributes: dict[str, Any]
    groups: dict[str, "Group"] = field(default_factory=dict)

    def everywhere(self) -> Iterator["Group"]:
        """This group, and all groups in it."""
        yield self
        for group in self.groups.values():
            yield from group.everywhere()


def read_group(source: Any) -> Group:
    """A group as it is stored."""
    source.set_auto_maskandscale(False)
    source.set_auto_chartostring(False)
    variables = {}
    for name, variable in source.variables.items():
        attributes = {key: variable.getncattr(key) for key in variable.ncattrs()}
        variables[name] = Variable(variable.dimensions, variable[...], attributes)
    attributes = {key: source.getncattr(key) for key in source.ncattrs()}
    groups = {name: read_group(group) for name, group in source.groups.items()}
    return Group({name: len(dim) for name, dim in source.dimensions.items()}, variables, attributes, groups)


def write_group(group: Group, target: Any) -> None:
    """Store a group. Values come last, as netCDF writes all definitions anew for each one that follows a value."""
    for made, values in list(define_group(group, target)):
        made[...] = values


def define_group(group: Group, target: Any) -> Iterator[tuple[Any, Any]]:
    """Define a group and those in it; each variable with the values that it is to have."""
    for name, length in group.dims.items():
        target.createDimension(name, length)
    target.setncatts(group.attributes)
    for name, variable in group.variables.items():
        values, attributes = np.asarray(variable.values), dict(variable.attributes)
        kind = str if values.dtype.kind in "OU" else values.dtype
        missing = attributes.pop("_FillValue", None)
        made = target.createVariable(name, kind, variable.dims, fill_value=None if kind is str else missing)
        made.set_auto_maskandscale(False)
        made.set_auto_chartostring(False)
        made.setncatts(attributes)
        yield made, values.astype(object) if kind is str else values
    for name, inner in group.groups.items():
        yield from define_group(inner, target.createGroup(name))


Edit = Callable[[Group, random.Random], str]
"""Changes a dataset; returns what it did."""


def drawn_variable(group: Group, drawn: random.Random, kinds: str) -> tuple[str, Variable]:
    """A variable whose values are of one of these numpy kinds."""
    found = []
    for each in group.everywhere():
        found += [pair for pair in each.variables.items() if np.asarray(pair[1].values).dtype.kind in kinds]
    return drawn.choice(found)


def put_number(group: Group, drawn: random.Random) -> str:
    """Overwrite a part of the numbers of a variable, or all."""
    name, variable = drawn_variable(group, drawn, "f")
    value = drawn.choice([np.nan, np.inf, -np.inf, 1e308, -1e308, 1e-310, 0.0, -1.0])
    values = np.array(variable.values)
    share = drawn.choice([1.0, 0.3])
    values[np.random.default_rng(drawn.randrange(2**32)).random(values.shape) <= share] = value
    variable.values = values
    return f"{value} in {share:.0%} of {name}"


def put_uncertainty(group: Group, drawn: random.Random) -> str:
    """Make a ± negative, infinite or huge."""
    names = [name for name in group.variables if name.endswith("_uncertainty")]
    name, value = drawn.choice(names), drawn.choice([-1.0, np.inf, 1e308, -1e-300])
    group.variables[name].values = np.full_like(group.variables[name].values, value)
    return f"{value} in {name}"


def put_code(group: Group, drawn: random.Random) -> str:
    """Put a whole number that means nothing: a code, a count, a place."""
    name, variable = drawn_variable(group, drawn, "iu")
    ends = np.iinfo(np.asarray(variable.values).dtype)
    value = drawn.choice([ends.min, ends.max, 99 if ends.max > 99 else 9, 0])
    variable.values = np.full_like(variable.values, value)
    return f"{value} in {name}"


def put_text(group: Group, drawn: random.Random) -> str:
    """Put an empty, long or strange text in a variable; of one of single letters, a letter that is none."""
    name, variable = drawn_variable(group, drawn, "OUS")
    if np.asarray(variable.values).dtype.kind == "S":
        letter = drawn.choice([b"", b"\xff", b"<", b"\x1b"])
        variable.values = np.full_like(variable.values, letter)
        return f"{letter!r} in {name}"
    text = drawn.choice(["", "x" * 1000, "a\u202eb\x1b[31m", "$\\frac{", "<script>", "NaN", "\n\n"])
    variable.values = np.full(np.shape(variable.values), text, object)
    return f"{text[:12]!r} in {name}"


def put_attribute(group: Group, drawn: random.Random) -> str:
    """Overwrite an attribute of a variable by something else."""
    pairs = [pair for each in group.everywhere() for pair in each.variables.items()]
    name, variable = drawn.choice([pair for pair in pairs if pair[1].attributes])
    key = drawn.choice(sorted(variable.attributes))
    value: Any = drawn.choice(["", "x" * 1000, "$\\frac{", 5, np.array([1.0, np.nan]), "banana 5"])
    if key == "_FillValue":
        key = "long_name"
    variable.attributes[key] = value
    return f"{str(value)[:12]!r} as {key} of {name}"


def put_own_attribute(group: Group, drawn: random.Random) -> str:
    """Overwrite an attribute of the dataset, or of a group."""
    where = drawn.choice([each for each in group.everywhere() if each.attributes])
    key = drawn.choice(sorted(where.attributes))
    value: Any = drawn.choice(["", "x" * 1000, "{", "[]", "null", '{"a": 1}', 5, np.array([1.0, np.nan])])
    where.attributes[key] = value
    return f"{str(value)[:12]!r} as {key}"


def drop_variable(group: Group, drawn: random.Random) -> str:
    """Leave a variable out."""
    where = drawn.choice([each for each in group.everywhere() if each.variables])
    name = drawn.choice(sorted(where.variables))
    del where.variables[name]
    return f"without {name}"


def drop_attribute(group: Group, drawn: random.Random) -> str:
    """Leave an attribute out."""
    owners: list[Any] = [each for each in group.everywhere() if each.attributes]
    owners += [one for each in group.everywhere() for one in each.variables.values() if one.attributes]
    where = drawn.choice(owners)
    key = drawn.choice(sorted(where.attributes))
    del where.attributes[key]
    return f"without attribute {key}"


def drop_group(group: Group, drawn: random.Random) -> str:
    """Leave a group out."""
    name = drawn.choice(sorted(group.groups))
    del group.groups[name]
    return f"without group {name}"


def change_shape(group: Group, drawn: random.Random) -> str:
    """Put a variable along other dimensions, or along none."""
    where = drawn.choice([each for each in group.everywhere() if each.variables])
    name = drawn.choice(sorted(where.variables))
    variable = where.variables[name]
    values = np.asarray(variable.values)
    one = values.ravel()[0] if values.size else 0
    choices: list[tuple[str, ...]] = [(), *((dim,) for dim in where.dims), tuple(reversed(variable.dims))]
    dims = drawn.choice([each for each in choices if all(dim in where.dims for dim in each)])
    variable.dims, variable.values = dims, np.full([where.dims[dim] for dim in dims], one, values.dtype)
    return f"{name} along {dims}"


def change_kind(group: Group, drawn: random.Random) -> str:
    """Store numbers as texts, and texts as numbers."""
    name, variable = drawn_variable(group, drawn, "fiuOUS")
    values = np.asarray(variable.values)
    is_text = values.dtype.kind in "OUS"
    variable.values = np.ones(values.shape) if is_text else np.full(values.shape, "banana", object)
    variable.attributes.pop("_FillValue", None)
    for key in ("flag_values", "flag_meanings", "scale_factor"):
        variable.attributes.pop(key, None)
    return f"{name} as {'numbers' if is_text else 'texts'}"


def add_variable(group: Group, drawn: random.Random) -> str:
    """Add a variable with the name of something else."""
    name = drawn.choice(["case", "cases", "drive", "si", "nanoslip", "__class__", "x" * 200, "a b", "μ", "0"])
    group.variables.setdefault(name, Variable((), np.float64(1.0), {}))
    return f"a variable {name[:20]!r}"


EDITS: Final[tuple[Edit, ...]] = (
    put_number,
    put_uncertainty,
    put_code,
    put_text,
    put_attribute,
    put_own_attribute,
    drop_variable,
    drop_attribute,
    drop_group,
    change_shape,
    change_kind,
    add_variable,
)

COMMANDS: Final[dict[str, tuple[str, ...]]] = {
    "report": ("report", "{campaign}", "--out", "{out}"),
    "figure": ("figure", "{campaign}", "--out", "{out}", "--y", "plateau_mean", "-o", "{out}/drawn.svg", "--csv"),
    "verify": ("verify", "{dataset}", "--sample", "1"),
    "compare": ("compare", "{dataset}", "{whole}"),
    "compare with it": ("compare", "{whole}", "{dataset}"),
    "show": ("show", "{dataset}", "radius=60", "intrinsic_friction=0.3"),
    "sensitivity": ("sensitivity", "{dataset}", "--of", "plateau_mean"),
    "status": ("status", "{campaign}", "--out", "{out}"),
    "export": ("export", "{dataset}", "--json"),
    "collect": ("collect", "{campaign}", "--out", "{out}"),
}
"""Commands that read a dataset; the last one may replace it."""
FOREIGN: Final = "Warning"
"""What a warning of a library has in its name."""


def prepare(folder: Path) -> Path:
    """A campaign and its results in a folder; returns that of the results."""
    campaign, out = folder / "hostile.toml", folder / "out"
    campaign.write_text(CAMPAIGN, "utf-8")
    plan, store = make_plan(load_manifest(campaign)), Store(out)
    compute(plan, store)
    write_dataset(plan, store)
    return out


def rewritten(group: Group, path: Path) -> None:
    """Write a dataset with a right checksum."""
    path.unlink(missing_ok=True)
    with netCDF4.Dataset(path, "w") as target:
        write_group(group, target)
    seal(path)
    check_seal(path)


def call(words: list[str]) -> str:
    """Call a command in this process; returns what is wrong with its end, or nothing."""
    said, output = StringIO(), StringIO()
    try:
        with (
            patch.object(sys, "argv", ["nanoslip", *words]),
            redirect_stderr(said),
            redirect_stdout(output),
            warnings.catch_warnings(),
        ):
            warnings.simplefilter("always")
            cli.main()
    except SystemExit as ended:
        code = int(ended.code or 0) if isinstance(ended.code, int | None) else 1
    except BaseException:
        return traceback.format_exc()
    text = said.getvalue()
    if FOREIGN in text:
        return text[-1000:]
    if code and not text.strip() and not output.getvalue().strip():
        return f"exit code {code} without a word"
    return ""


def trial(whole: Path, scratch: Path, group: Group, commands: list[str]) -> dict[str, str]:
    """What is wrong with the ends of commands on a changed dataset, by command."""
    shutil.rmtree(scratch, ignore_errors=True)
    shutil.copytree(whole, scratch)
    rewritten(group, scratch / FILE)
    places = {
        "campaign": str(whole.parent / "hostile.toml"),
        "out": str(scratch),
        "dataset": str(scratch / FILE),
        "whole": str(whole / FILE),
    }
    found = {}
    for name in commands:
        if wrong := call([word.format(**places) for word in COMMANDS[name]]):
            found[name] = wrong
    return found


def main() -> None:
    """Do so many trials; print each that ends badly."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=200)
    parser.add_argument("--first", type=int, default=0, help="number of the first trial: one that ended badly, again")
    parser.add_argument("--only", default="", help="commands, by a comma; all by default")
    asked = parser.parse_args()
    pin_arithmetic()
    commands = asked.only.split(",") if asked.only else list(COMMANDS)
    bad = 0
    with TemporaryDirectory() as folder:
        whole = prepare(Path(folder))
        with netCDF4.Dataset(whole / FILE) as source:
            right = read_group(source)
        print("unchanged:", trial(whole, Path(folder) / "copy", right, commands) or "well", flush=True)
        for number in range(asked.first, asked.first + asked.trials):
            drawn, group = random.Random(number), copy.deepcopy(right)
            edit = EDITS[number % len(EDITS)]
            what = edit(group, drawn)
            found = trial(whole, Path(folder) / "copy", group, commands)
            bad += bool(found)
            print(f"{number} {what}: {found or 'well'}", flush=True)
            for name, wrong in found.items():
                print(f"--- {name}\n{wrong}", flush=True)
    print(f"{asked.trials} datasets, {bad} with a bad end")
    sys.exit(bool(bad))


if __name__ == "__main__":
    main()
