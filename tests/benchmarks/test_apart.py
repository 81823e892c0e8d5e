"""Every benchmark can be begun, and no benchmark's memory is counted as that of the next."""

import importlib
import resource

import numpy as np
import pytest

from tests.benchmarks import __main__ as benchmarks, apart
from tests.benchmarks.table import Row


def rows() -> list[Row]:
    """The most memory that this process has held, in MB, and then some more of it."""
    held = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024
    np.ones(50_000_000)
    return [Row("memory", str(held), "", "", "")]


@pytest.mark.slow
def test_each_benchmark_has_a_process_of_its_own(capsys: pytest.CaptureFixture[str]) -> None:
    """400 MB are held by the first, as this file stands for two benchmarks."""
    first, second = apart.rows_of(["test_apart", "test_apart"])
    assert int(second.ours) < int(first.ours) + 100
    assert capsys.readouterr().err == "test_apart …\ntest_apart …\n"


@pytest.mark.parametrize("name", benchmarks.NAMES)
def test_every_benchmark_can_be_imported(name: str) -> None:
    assert importlib.import_module(f"tests.benchmarks.{name}").rows
