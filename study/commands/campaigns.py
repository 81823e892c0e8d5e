"""`nanoslip campaigns`: the campaigns that come with nanoslip."""

import tomllib

import click

from study import shipped


def work() -> None:
    """Print name and title of each campaign that comes with nanoslip."""
    found = shipped.campaigns()
    width = max(map(len, found))
    for name, path in found.items():
        click.echo(f"{name:{width}}  {tomllib.loads(path.read_text('utf-8'))['title']}")
    click.echo(f"nanoslip run NAME computes one; the files are in {shipped.folder('campaigns')}")
