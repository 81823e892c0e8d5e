"""`nanoslip campaigns`: the campaigns that come with nanoslip."""

import tomllib

import click

from study import shipped


@click.command("campaigns")
def command() -> None:
    """List the campaigns that come with nanoslip, to run by name or to copy."""
    found = shipped.campaigns()
    width = max(map(len, found))
    for name, path in found.items():
        click.echo(f"{name:{width}}  {tomllib.loads(path.read_text('utf-8'))['title']}")
    click.echo(f"nanoslip run NAME computes one; the files are in {shipped.folder('campaigns')}")
