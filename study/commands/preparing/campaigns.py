"""`nanoslip campaigns`: the campaigns that come with nanoslip."""

import tomllib
from collections.abc import Mapping
from pathlib import Path

import click

from study import shipped
from study.commands.shared.machine import print_json


def work(as_json: bool) -> None:
    """Print name and title of each campaign that comes with nanoslip."""
    found = shipped.campaigns()
    if as_json:
        print_json([{"name": name, "title": title_of(path), "file": str(path)} for name, path in found.items()])
        return
    print_titles(found)
    click.echo(f"nanoslip run NAME computes one; the files are in {shipped.folder('campaigns')}")


def print_titles(found: Mapping[str, Path]) -> None:
    """Print name and title of campaigns, by name."""
    width = max(map(len, found))
    for name, path in found.items():
        click.echo(f"{name:{width}}  {title_of(path)}")


def title_of(path: Path) -> str:
    """The title that a campaign file gives itself."""
    return str(tomllib.loads(path.read_text("utf-8"))["title"])
