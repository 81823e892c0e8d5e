"""`nanoslip campaigns`: the campaigns that come with nanoslip."""

import tomllib
from collections.abc import Mapping
from pathlib import Path

from nanoslip.study import shipped
from nanoslip.study.commands.shared.machine import print_json
from nanoslip.study.report.console import print_entries, say, whole


def work(as_json: bool) -> None:
    """Print name and title of each campaign that comes with nanoslip."""
    found = shipped.campaigns()
    if as_json:
        print_json([{"name": name, "title": title_of(path), "file": str(path)} for name, path in found.items()])
        return
    print_titles(found)
    say(f"{whole('nanoslip run NAME')} computes one; the files are in {whole(shipped.folder('campaigns'))}")


def print_titles(found: Mapping[str, Path]) -> None:
    """Print name and title of campaigns, by name."""
    print_entries({name: title_of(path) for name, path in found.items()})


def title_of(path: Path) -> str:
    """The title that a campaign file gives itself."""
    return str(tomllib.loads(path.read_text("utf-8"))["title"])
