"""`nanoslip campaigns`: the campaigns that come with nanoslip."""

import tomllib

import click

from study import shipped
from study.commands.shared.machine import print_json


def work(as_json: bool) -> None:
    """Print name and title of each campaign that comes with nanoslip."""
    found = shipped.campaigns()
    titles = {name: str(tomllib.loads(path.read_text("utf-8"))["title"]) for name, path in found.items()}
    if as_json:
        print_json([{"name": name, "title": titles[name], "file": str(path)} for name, path in found.items()])
        return
    width = max(map(len, found))
    for name, title in titles.items():
        click.echo(f"{name:{width}}  {title}")
    click.echo(f"nanoslip run NAME computes one; the files are in {shipped.folder('campaigns')}")
