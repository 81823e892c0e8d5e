"""A campaign's dataset: from the file that is named, from the campaign's own, or from the results that are there."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import xarray as xr

from nanoslip.study.commands.shared.arguments import folder
from nanoslip.study.commands.shared.plans import advised, planned
from nanoslip.study.dataset import file
from nanoslip.study.dataset.collect import collect
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.report.console import say
from nanoslip.study.results.store import Store, StoreError


@contextmanager
def dataset_of(source: Path, out: Path | None = None) -> Iterator[xr.Dataset]:
    """Open a dataset: a file .nc, a folder with results.nc, or a campaign file.

    A campaign's own results.nc is taken where the campaign has not changed since; else its finished results, collected in
    memory. out: folder of a campaign's results. Raises StoreError, ManifestError.
    """
    if source.is_dir() or source.suffix == Path(file.FILE).suffix:
        with file.reading(source / file.FILE if source.is_dir() else source) as found:
            yield found
        return
    plan, into = planned(source), folder(source, out)
    if (into / file.FILE).is_file():
        with file.reading(into / file.FILE) as found:
            if is_of(found, plan.manifest):
                yield found
                return
    store = Store(into)
    if not store.finished():
        raise StoreError(f"{into}: no results of {source} there: {advised('run', source, into)} computes them")
    say(f"{into}: no dataset of {source} as it is now: from the results that are finished", stderr=True)
    yield collect(plan, store)


def is_of(dataset: xr.Dataset, manifest: Manifest) -> bool:
    """Whether a dataset is of the campaign as it is, and not of what its file said earlier."""
    return bool(dataset.attrs.get("manifest_sha256") == manifest.sha256)
