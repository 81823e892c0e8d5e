"""`nanoslip new`: a commented campaign to start from, written where the user wants it."""

from collections.abc import Mapping
from pathlib import Path

from nanoslip.study import shipped
from nanoslip.study.commands.preparing.campaigns import print_titles
from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.commands.shared.refusals import refusals
from nanoslip.study.figures.shared.files import write_files
from nanoslip.study.report.console import say, whole


def work(starter: str | None, file: Path | None) -> None:
    """Write a starter, and the files that it names, beside each other; without a name list the starters."""
    found = shipped.starters()
    if starter is None:
        print_titles(found)
        say(f"{whole('nanoslip new NAME [FILE]')} writes one, to be changed")
        return
    if starter not in found:
        raise Refusal(f"{starter}: no starter; there are {', '.join(found)}")
    target = file or Path(f"{starter}.toml")
    _write({found[starter]: target} | {path: target.with_name(path.name) for path in _beside(found[starter])})
    say(
        f"{whole(f'written: {target}')}; change it, then: "
        f"{whole(f'nanoslip check {target}')}; {whole(f'nanoslip run {target}')}"
    )


def _beside(starter: Path) -> list[Path]:
    """The files that a starter names: those of its name."""
    return [path for path in starter.parent.glob(f"{starter.stem}.*") if path != starter]


def _write(copies: Mapping[Path, Path]) -> None:
    """Copy each file to its place, which must be free; nothing is written where one is not. Raises Refusal."""
    if taken := [str(target) for target in copies.values() if target.exists()]:
        raise Refusal(f"{', '.join(taken)}: there already, and is not overwritten: needs another name")
    with refusals():
        write_files({target: source.read_bytes() for source, target in copies.items()})
