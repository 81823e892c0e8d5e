"""A campaign's dataset: written from its results, and printed as a table."""

from pathlib import Path

import xarray as xr

from study.dataset import file
from study.dataset.collection.collect import collect
from study.plan.plan import Plan
from study.report.common import said_once
from study.report.console import print_sentences, print_table, say, whole
from study.report.summary import drive_summary, failure_summary, flag_summary, scalar_table
from study.results.store import Store


def write_dataset(plan: Plan, out: Path) -> None:
    """Write the dataset of the results that are there, and print it. Raises StoreError."""
    collected = collect(plan, Store(out))
    path = out / file.FILE
    file.write(collected, path)
    print_summary(collected)
    say(whole(f"dataset: {path}"))
    if mixed := collected.attrs.get(file.MIXED):
        say(f"{mixed} (computed_by says which case is whose)")


def print_summary(dataset: xr.Dataset) -> None:
    """Print the table of a dataset's cases, how its drives ended, why and what to do, and the advice of its validity flags."""
    table, alike = said_once(scalar_table(dataset, why=False))
    print_table(table)
    print_sentences(alike)
    print_sentences(drive_summary(dataset))
    print_sentences(failure_summary(dataset), "failed")
    print_sentences(flag_summary(dataset))
