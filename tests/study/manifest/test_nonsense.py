"""Whatever a file says, it is taken or refused in words: every key of a campaign with every kind of nonsense, and fronts."""

import itertools
import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from nanoslip.solver.drive import Scales
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import collect
from nanoslip.study.dataset.variables import factors
from nanoslip.study.manifest.manifest import EnsembleTable, Outputs, drive_parameters
from nanoslip.study.manifest.parameters import TABLES, table_words
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.plan import Plan, make_plan
from nanoslip.study.results.store import Store
from tests.study.manifest.problems import lines_of

PLAIN = (
    *("-1", "0", "-0.0", "nan", "inf", "-inf", "1e308", "1e-308", "5e-324", "0.5", "true", "false"),
    *('"nonsense"', '""', '"  "', '"a\\nb"', '"a\\u0000b"', "2022-01-01", "07:32:00", "1979-05-27T07:32:00Z"),
    *("[]", "[[1, 2], [[]]]", '[1, "a", true, 2.5]', "[1, 2, 3]", "{}", "{a = {b = 1}}"),
)
NONSENSE = {
    **{text: text for text in PLAIN},
    **{f"2^{power}": str(2**power) for power in (53, 63, 64, 70)},
    "2^63 - 1": str(2**63 - 1),
    "-2^63": str(-(2**63)),
    "2^1100 + 1": str(2**1100 + 1),
    "400 digits": "1" + "0" * 400,
    "a float of 400 digits": "1" + "0" * 400 + ".0",
    "6000 digits, which Python does not write": "0x" + "f" * 5000,
    "a long text": '"' + "x" * 10_000 + '"',
    "a list of huge numbers": f"[1, {2**70}]",
    "a list of endless numbers": "[0x" + "f" * 5000 + "]",
}

PLACES: dict[str, list[str]] = {
    "top level": [
        "title", "stages", "design", "table", "axes", "drives", "drive_axes", "scales", "ensemble",
        *TABLES,
    ],
    **{table: list(table_words(table)) for table in TABLES},
    "axes": [word for table in TABLES for word in table_words(table)],
    "scales": [item.name for item in fields(Scales)],
    "outputs": [item.name for item in fields(Outputs)],
    "ensemble": [item.name for item in fields(EnsembleTable)],
    "drives": ["name", *drive_parameters()],
    "drive_axes": ["name", *drive_parameters()],
    "unknown": ["nonsense", '"two words"', '"a\\nb"', "x" * 5000, ".".join("x" * 2000), '""'],
}  # fmt: skip
KEYS = [(place, key) for place, keys in PLACES.items() for key in keys]

LISTED = 3
"""In lists of values and in tables, which have each value checked as its key has it alone, each key meets one of so many kinds of
nonsense, and each kind is met by one of so many keys."""
LONGEST = 300
"""Characters of a line, the file's name and a list of all allowed words left out."""


def parsed(value: str) -> Any:
    """What TOML makes of it; the text itself where that is nothing."""
    try:
        return tomllib.loads(f"x = {value}")["x"]
    except ValueError:
        return value


def campaign(place: str, key: str, value: str) -> str:
    """A campaign that is right but for one key."""
    title = "" if key == "title" and place == "top level" else 'title = "x"\n'
    drive = '[[drives]]\nname = "a"\n'
    if place in ("top level", "unknown"):
        return f"{title}{key} = {value}\n"
    if place == "drives":
        own = drive.replace('name = "a"\n', "") if key == "name" else drive
        return f"{title}{own}{key} = {value}\n"
    if place in ("axes", "drive_axes"):
        return f"{title}{place}.{key} = [{value}]\n"
    return f"{title}[{place}]\n{key} = {value}\n{drive if place == 'scales' else ''}"


def planned_or_refused(path: Path) -> Plan | tuple[str, ...]:
    """The plan of a campaign with its cases' units, or the lines of its refusal."""
    try:
        planned = make_plan(load_manifest(path))
    except ManifestError as error:
        return lines_of(error)
    for case in planned.cases:
        for drive in (None, *(each.drive for each in planned.manifest.drives)):
            if case.case is not None:
                factors(case.case, planned.manifest.scales, drive)
    return planned


def refusals(path: Path, campaigns: Iterable[tuple[str, Any, tuple[str, ...]]]) -> Iterator[tuple[str, str]]:
    """Name and lines of refusals of campaigns: what each is, the value of its key, texts of files. Of those that are taken, the
    dataset of the last with a value of each type can be written and read."""
    taken: dict[type, Plan] = {}
    for name, value, texts in campaigns:
        for each, text in zip((path, path.with_name("cases.csv")), texts, strict=False):
            each.write_text(text, "utf-8")
        found = planned_or_refused(path)
        if isinstance(found, Plan):
            taken[float if type(value) is int else type(value)] = found
        else:
            yield from ((name, line) for line in found)
    for planned in taken.values():
        read_back(planned, path)


def read_back(planned: Plan, path: Path) -> xr.Dataset:
    file.write_netcdf(collect(planned, Store(path.parent)), path.with_suffix(".nc"))
    with file.open_dataset(path.with_suffix(".nc")) as opened:
        return opened.load()


@pytest.mark.slow
@pytest.mark.parametrize(("place", "key"), KEYS, ids=[f"{place}.{key[:20]}" for place, key in KEYS])
def test_every_key_takes_or_refuses_every_value(tmp_path, place, key):
    path = tmp_path / "mine.toml"
    step = LISTED if place in ("axes", "drive_axes") else 1
    values = list(NONSENSE.items())[PLACES[place].index(key) % step :: step]
    campaigns = ((name, parsed(value), (campaign(place, key, value),)) for name, value in values)
    for name, lines in itertools.groupby(refusals(path, campaigns), lambda each: each[0]):
        said = [line for _, line in lines]
        for line in said:
            assert line.startswith(str(tmp_path)), (name, line)
            short = re.split("needs one of|each one of", line.replace(str(tmp_path), ""))[0]
            assert "\n" not in short, name
            assert len(short) < LONGEST, (name, short)
        if place != "unknown" and "not TOML" not in said[0] and said[0].startswith(f"{path}: "):
            assert any(key in line for line in said), (name, said)


@pytest.mark.slow
def test_a_table_takes_or_refuses_every_cell(tmp_path):
    path = tmp_path / "mine.toml"
    values = [value.strip('"') for value in NONSENSE.values()]
    short = [value for value in values if len(value) < 500]
    words = [word for table in TABLES for word in table_words(table) if word != "roughness"]
    for number, word in enumerate(words):
        cells = values if word == "n_x" else short[number % LISTED :: LISTED]
        campaigns = (
            (cell, parsed(cell), ('title = "x"\ntable = "cases.csv"\n', f'{word}\n"{cell}"\n')) for cell in cells
        )
        for cell, line in refusals(path, campaigns):
            assert line.startswith(f"{tmp_path}/"), (word, cell, line)
            assert len(line) < LONGEST + 100, (word, cell, line)


def test_a_value_that_is_just_small_enough_survives_to_the_dataset(tmp_path):
    """The largest whole numbers that are taken are those that the dataset's integers hold."""
    path = tmp_path / "mine.toml"
    most = 2**63 - 1
    path.write_text(f'title = "x"\nslip.cascade_limit = {most}\naxes.seed = [0, {most}]\n')
    more = path.with_name("more.toml")
    more.write_text(path.read_text().replace(f"limit = {most}", f"limit = {most + 1}"))
    with pytest.raises(ManifestError, match=r"slip\.cascade_limit"):
        load_manifest(more)
    opened = read_back(make_plan(load_manifest(path)), path)
    assert (int(opened.cascade_limit), opened.seed.values.tolist()) == (most, [0, most])
