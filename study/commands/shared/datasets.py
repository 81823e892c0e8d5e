"""A campaign's dataset: written from its results, and printed as a table."""

import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Final

import xarray as xr

from nanoslip.study.commands.shared.plans import advised, counted
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import Planned, collect
from nanoslip.study.dataset.file import is_made_of, made_of, note
from nanoslip.study.dataset.variables import OUTCOMES, means_of
from nanoslip.study.garbage import all_kept
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.plan.plan import PENDING
from nanoslip.study.report.console import counting, print_sentences, print_table, say, whole
from nanoslip.study.report.summary import (
    MOST_LINES,
    drive_summary,
    failure_summary,
    flag_summary,
    left_out_summary,
    said_once,
    scalar_table,
    short_summary,
)
from nanoslip.study.results.store import Store, StoreError

COLLECTED: Final = "{} cases collected"
"""What is shown while a dataset is made."""


def write_dataset(plan: Planned, store: Store, anew: bool = False, processes: int = 1, keep: bool = False) -> int:
    """Write the dataset of the results that are there, and print it; returns how many outcomes are pending. Raises StoreError.

    anew: also where it is there already. processes: that read results. keep: refuse instead where the one that is there has
    more finished cases or drives.
    """
    if not anew and print_written(plan.manifest, store):
        return 0
    path = store.folder.parent / file.FILE
    with counting(COLLECTED) as heard, all_kept():
        collected = collect(plan, store, heard, processes)
    if keep and (losses := list(_losses(path, collected))):
        campaign, into = plan.manifest.path, path.parent
        run, replace = advised("run", campaign, into), advised("collect", campaign, into, "--replace")
        raise StoreError(
            f"{path}: not replaced: has {'; '.join(losses)}; has the campaign changed? {run} computes what is "
            f"missing, {replace} writes the dataset without it"
        )
    file.write(collected, path)
    note(path, store, made_of(plan.manifest, store))
    _print(collected, path)
    return _pending(collected)


def print_written(manifest: Manifest, store: Store) -> bool:
    """Print the existing dataset if it is up to date with the results and lacks none; returns whether that is so."""
    path = store.folder.parent / file.FILE
    if is_made_of(path, store, made_of(manifest, store)):
        with suppress(StoreError), file.reading(path) as found:  # else it was damaged
            if not _pending(found):
                _print(found, path)
                return True
    return False


def _pending(dataset: xr.Dataset) -> int:
    """How many cases and drives have no outcome yet."""
    endings = [dataset[ending.name] for ending, _ in OUTCOMES.values() if ending.name in dataset]
    return sum(int((each == PENDING).sum()) for each in endings)


def _losses(path: Path, collected: xr.Dataset) -> Iterator[str]:
    """What a dataset that is there has more of than the one that would replace it: nothing where that lacks nothing.

    One that cannot be read is no loss.
    """
    with suppress(StoreError), file.reading(path) as found:
        for kind, (ending, _) in OUTCOMES.items():
            if ending.name in found and ending.name in collected:
                had, has = (int((each[ending.name] != PENDING).sum()) for each in (found, collected))
                if has < min(had, collected[ending.name].size):
                    what = counted(had, f"finished {kind or 'case'}")
                    yield f"{what}, collected now {has} of {collected[ending.name].size}"


def _print(dataset: xr.Dataset, path: Path) -> None:
    print_summary(dataset)
    say(whole(f"dataset: {path}"))
    if mixed := dataset.attrs.get(file.MIXED):
        say(f"{mixed} (computed_by says which case is whose)")


def print_summary(dataset: xr.Dataset) -> None:
    """Print the table of a dataset's cases, how its drives ended, why and what to do, where an ensemble
    knows less than was asked for, and the advice of its validity flags."""
    table, alike = said_once(scalar_table(dataset, why=False, most=MOST_LINES))
    print_table(table)
    print_sentences(_chosen(dataset))
    print_sentences([*alike, *filter(None, [means_of(dataset)])])
    print_sentences(drive_summary(dataset))
    print_sentences(failure_summary(dataset), "failed")
    print_sentences([*left_out_summary(dataset), *short_summary(dataset), *flag_summary(dataset)])


def _chosen(dataset: xr.Dataset) -> Iterator[str]:
    """The grid that was chosen for a campaign's `accuracy`."""
    if file.CHOSEN in dataset.attrs:
        found = json.loads(dataset.attrs[file.CHOSEN])
        yield f"chosen: {', '.join(f'{name} = {value}' for name, value in found.items())}"
