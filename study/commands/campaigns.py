"""`nanoslip campaigns`: the campaigns that come with nanoslip."""

import tomllib
from collections.abc import Mapping
from pathlib import Path

import click

from study import shipped


def work() -> None:
    """Print name and title of each campaign that comes with nanoslip."""
    print_titles(shipped.campaigns())
    click.echo(f"nanoslip run NAME computes one; the files are in {shipped.folder('campaigns')}")


def print_titles(found: Mapping[str, Path]) -> None:
    """Print name and title of campaigns, by name."""
    width = max(map(len, found))
    for name, path in found.items():
        click.echo(f"{name:{width}}  {tomllib.loads(path.read_text('utf-8'))['title']}")
