"""Errors that the user can correct, as messages of the command line."""

from collections.abc import Iterator
from contextlib import contextmanager

from nanoslip.study.commands.shared.exits import Refusal
from nanoslip.study.manifest.checker import ManifestError
from nanoslip.study.results.store import StoreError


@contextmanager
def refusals(*more: type[Exception]) -> Iterator[None]:
    """Turn errors of manifests and of files of results, and those given, into a `Refusal`."""
    kinds: tuple[type[Exception], ...] = (ManifestError, StoreError, *more)
    try:
        yield
    except kinds as error:
        raise Refusal(str(error)) from error
