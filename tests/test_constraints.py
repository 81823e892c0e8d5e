"""The ends of what is supported: one version of each package at either end, as the project declares them."""

import re
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
from packaging.version import Version

ROOT = Path(__file__).parents[1]
NEEDED = dict(
    re.fullmatch(r"([\w-]+)>=([\w.]+)", each).groups()  # type: ignore[union-attr]
    for each in tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["dependencies"]
)


def pinned(name: str) -> dict[str, Version]:
    lines = (ROOT / f"constraints/{name}.txt").read_text("utf-8").splitlines()
    return {
        package: Version(version) for package, _, version in (line.partition("==") for line in lines if "==" in line)
    }


def test_the_lowest_versions_are_those_that_the_project_asks_for() -> None:
    lowest = pinned("lowest")
    assert lowest == {name: lowest[name] for name in NEEDED}
    for name, least in NEEDED.items():
        assert lowest[name].release[: len(Version(least).release)] == Version(least).release


@pytest.mark.parametrize("name", NEEDED)
def test_what_tests_run_with_is_no_older_than_the_lowest(name: str) -> None:
    assert pinned("lowest")[name] <= Version(metadata.version(name))
    assert pinned("lowest")[name] <= pinned("highest")[name]


def test_the_recipe_asks_for_the_same_and_the_licence_of_every_package_is_listed() -> None:
    recipe = dict(re.findall(r"- ([\w-]+) >=([\d.]+)\n", (ROOT / "docs/release/recipe.yaml").read_text("utf-8")))
    packages = {name.lower(): least for name, least in NEEDED.items()}
    packages["matplotlib-base"] = packages.pop("matplotlib")  # without windows
    assert {name: recipe[name] for name in packages} == packages
    licences = (ROOT / "docs/developers.md").read_text("utf-8").partition("## Packages and their licences")[2]
    assert all(name in licences for name in NEEDED)
