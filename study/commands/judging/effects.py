"""`nanoslip effects`: the measured influence of each effect; and a test of the tolerance within which effects are left out."""

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from solver.outcome import quoted
from study.accuracy.influence.judgement import FIRST, Trial, trial
from study.accuracy.influence.measurement import measure, spread_out
from study.accuracy.influence.picture import draw
from study.accuracy.influence.verdict import as_markdown
from study.commands.shared.exits import Refusal
from study.commands.shared.refusals import refusals
from study.execution.launch import cores
from study.plan.influence.omissions import OMISSIONS
from study.plan.influence.scene import ASKED_FOR, OBSERVABLES
from study.plan.influence.table import Influences, load_influences
from study.report.columns import Table
from study.report.console import counting, print_table, say, whole
from study.results.store import StoreError
from study.results.whole_file import written_whole

SHOWN: Final = ("maximum_pressure", *ASKED_FOR["dynamics"])


def work(
    measured: int | None, judged: int | None, named: Sequence[str], save: Path | None, processes: int | None
) -> None:
    """Print the influence of each effect; or measure the influences, or test choices made by them, on so many random scenes.

    named: effects that are measured; without names all are.
    """
    with refusals():
        if measured and judged:
            raise Refusal("--measure and --judge: needs one of them at a time")
        _check_named(named, measured)
        if save and not (measured or judged):
            raise Refusal("--save: needs --measure or --judge beside it")
        if save and judged and save.suffix == ".png":
            raise Refusal(f"--save {save}: needs the name of a text, as judged.md; its picture is written beside it")
        if not (measured or judged):
            say(f"relative change by leaving an effect out, median … 95 %; scenes: {load_influences().about['scenes']}")
            print_table(_table(load_influences()))
            return
        trials: Sequence[Trial] = ()
        if save:
            _make_folder(save)  # what took hours finds its place
        with counting("{} scenes done") as heard:
            side_by_side = processes or cores()
            if measured:
                text = measure(measured, side_by_side, heard, named)
            else:
                seeds = range(FIRST, FIRST + (judged or 0))
                trials = list(spread_out(trial, seeds, side_by_side, heard))
                text = as_markdown(trials)
        if save is None:
            print(text, end="")
            return
        contents = {save: text.encode()} | ({} if measured else {save.with_suffix(".png"): draw(trials)})
        for path, content in contents.items():
            _write(path, content)
            say(whole(f"written: {path}"))


def _check_named(named: Sequence[str], measured: int | None) -> None:
    if named and not measured:
        raise Refusal("--effect: needs --measure beside it")
    for name in named:
        if name not in OMISSIONS:
            raise Refusal(f"--effect {quoted(name)}: needs one of {', '.join(OMISSIONS)}")


def _make_folder(path: Path) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _not_written(path, error) from None


def _write(path: Path, content: bytes) -> None:
    try:
        with written_whole(path) as scratch:
            scratch.write_bytes(content)
    except OSError as error:
        raise _not_written(path, error) from None


def _not_written(path: Path, error: OSError) -> StoreError:
    return StoreError(f"{path}: cannot be written: {error.strerror or error}")


def _table(influences: Influences) -> Table:
    """Median and 95 % of the scenes, effect by effect, and what theory says."""
    rows = []
    for name, omission in OMISSIONS.items():
        columns = [OBSERVABLES.index(each) for each in omission.observables]
        cells = []
        for shown in SHOWN:
            number = OBSERVABLES.index(shown)
            known = influences.effects[name].influences[:, columns.index(number)] if number in columns else np.array([])
            known = known[~np.isnan(known)]
            cells.append(f"{np.median(known):.1g} … {np.quantile(known, 0.95):.1g}" if len(known) else "")
        governed = ", ".join(group.symbol for group in omission.groups)
        rows.append((name, *cells, f"governed by {governed}; {omission.theory}"))
    return Table(("effect", *SHOWN, "theory"), tuple(rows), 1, prose=True)
