"""What tests of several files share: small campaigns, and ways to run them."""

import gc
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Callable, Generator
from contextlib import ExitStack
from itertools import combinations
from pathlib import Path

import pytest

from nanoslip.solver.compiled import Kernel
from nanoslip.study.commands import cli
from tests import UNPINNED
from tests.rounding import rounding_otherwise

os.environ.pop("COLUMNS", None)  # tables as wide as in a pipe

ROOT = Path(__file__).parents[1]

SMALL = """\
title = "A small campaign"
stages = ["contact", "slip", "dynamics"]
ensemble.members = 1

[axes]
intrinsic_friction = [0.25, 0.5]
radius = [50.0, 100.0]

[numerics]
n_x = 17

[limits]
events = 200

[[drives]]
name = "slow"
duration = 0.2
stage_velocity = 1e-3
samples = 40

[[drives]]
name = "fast"
duration = 0.2
samples = 40

[outputs]
fit = false
"""
"""Without fits of the closed form, a fifth of the time of a run."""

PARTLY_REFUSED = SMALL.replace("n_x = 17", 'scheme = "biquadratic"').replace(
    "[axes]", "[axes]\nrows = [4, 5]\nn_x = [9, 17]"
)
"""Sixteen cases, four of them refused: five rows are too many at n_x = 9."""


def for_python(kernel: Kernel) -> Kernel:
    """A kernel that kernels alone call, compiled so that a test can call it."""
    return Kernel(kernel.py_func, kernel.allocates, True, kernel.targetoptions | {"no_cpython_wrapper": False})


def longer(radii: int, events: int) -> str:
    """The small campaign at n_x = 65, of so many radii and events: long enough to be interrupted in the middle."""
    numbers = [50.0 + number for number in range(radii)]
    changed = SMALL.replace("[50.0, 100.0]", str(numbers)).replace("n_x = 17", "n_x = 65")
    return changed.replace("events = 200", f"events = {events}")


OPEN_MPI = {
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
    "PRTE_MCA_hwloc_default_binding_policy": "none",
    "OMPI_MCA_btl": "^ofi",
}
"""What Open MPI needs to start more ranks than cores, as root too, without binding children to one core, and at once. Other
libraries do not read it."""

Command = Callable[..., "subprocess.CompletedProcess[str]"]
Main = Callable[..., tuple[int, str, str]]
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "NUMBA_NUM_THREADS")


def clean_environment() -> dict[str, str]:
    """What the fixture `environment` gives."""
    kept = {name: value for name, value in UNPINNED.items() if not name.startswith(("PMI", "OMPI", "SLURM", "COLUMNS"))}
    return kept | OPEN_MPI | {"PYTHONPATH": str(ROOT), "PATH": str(Path(sys.executable).parent)}


def pytest_configure(config: pytest.Config) -> None:
    """With NANOSLIP_TEST_ROUNDING=1 compliances are rounded otherwise, as by another kernel of BLAS.

    From here on, as tests share compliances that are made when their files are imported.
    """
    if os.environ.get("NANOSLIP_TEST_ROUNDING"):
        rounding = ExitStack()
        rounding.enter_context(rounding_otherwise())
        config.add_cleanup(rounding.close)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark as slow what a grid marked `everyday` has beside the few items that stand for it every day."""
    grids: dict[str, list[pytest.Item]] = {}
    for item in items:
        if item.get_closest_marker("everyday") and not item.get_closest_marker("slow"):
            grids.setdefault(item.nodeid.partition("[")[0], []).append(item)
    for grid in grids.values():
        marker = grid[0].get_closest_marker("everyday")
        values = [getattr(item, "callspec").params for item in grid]  # noqa: B009  of parametrized functions alone
        few = spaced(len(grid), *marker.args) if marker and marker.args else covering(values)
        for number in set(range(len(grid))) - few:
            grid[number].add_marker("slow")


def pytest_collection_finish() -> None:
    """Keep what collection has made, which lives to the end, out of all later searches for garbage: 2 % of the time."""
    gc.collect()
    gc.freeze()


LONGEST = 5.0
"""Seconds of processor time that an everyday test may take: a second, and what it is the first to import on a busy machine."""


def processor_time() -> float:
    """Seconds of this process and of those that it has waited for."""
    return sum(os.times()[:4])


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Note the processor time of a test in its report."""
    before = processor_time()
    result = yield
    item.user_properties.append(("processor_time", processor_time() - before))
    return result


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name everyday tests that take long. Nothing fails by a time, which is the machine's as well."""
    for report in terminalreporter.getreports("passed"):
        seconds = dict(report.user_properties).get("processor_time", 0.0)
        if "slow" not in report.keywords and seconds > LONGEST:
            line = f"{report.nodeid}: {seconds:.1f} s of processor time: make it cheaper, or mark it slow"
            terminalreporter.write_line(line, yellow=True)


def spaced(of: int, count: int) -> set[int]:
    """So many numbers below `of`, evenly spaced, both ends among them if there are two or more."""
    return {round(number * (of - 1) / max(count - 1, 1)) for number in range(count)}


def covering(values: list[dict[str, object]]) -> set[int]:
    """Which items of a grid hold every pair of values of two parameters; of one parameter each value."""
    size = min(2, len(values[0]))
    pairs = [set(combinations(sorted((name, repr(value)) for name, value in item.items()), size)) for item in values]
    left, few = set().union(*pairs), set()
    while left:
        best = max(range(len(pairs)), key=lambda number: len(pairs[number] & left))
        few.add(best)
        left -= pairs[best]
    return few


@pytest.fixture
def campaign(tmp_path: Path) -> Path:
    """The small campaign as a file."""
    path = tmp_path / "small.toml"
    path.write_text(SMALL)
    return path


def compute(folder: Path, text: str) -> Path:
    """Compute a campaign in this process into a folder; for fixtures that several tests share."""
    (folder / "small.toml").write_text(text)
    with pytest.MonkeyPatch.context() as patch:
        for name in THREADS:
            patch.setenv(name, "1")
        patch.setattr(sys, "argv", ["nanoslip", "run", f"{folder / 'small.toml'}", "--out", f"{folder}", "--serial"])
        with pytest.raises(SystemExit) as ended:
            cli.main()
    assert not ended.value.code
    return folder


@pytest.fixture(scope="session")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of the small campaign, computed once in a process; `finished` is a copy."""
    return compute(tmp_path_factory.mktemp("computed"), SMALL)


@pytest.fixture
def finished(computed: Path, campaign: Path) -> Path:
    """The folder of a run of `campaign` that has finished: a test may do with it what it likes."""
    return shutil.copytree(computed, campaign.parent / "finished", ignore=shutil.ignore_patterns("*.toml"))


@pytest.fixture(scope="session")
def environment() -> dict[str, str]:
    """The environment of a subprocess that is to find this source tree, no launcher and no git.

    Without git the source commit is "unknown": datasets stay comparable while somebody commits.
    """
    return clean_environment()


@pytest.fixture(scope="session")
def nanoslip(environment: dict[str, str]) -> Command:
    """Run the command line in a process of its own: `nanoslip("run", campaign, ..., ranks=2)`; no ranks: no launcher."""

    def command(*arguments: object, ranks: int = 0, **changes: str) -> "subprocess.CompletedProcess[str]":
        words = [*launcher(ranks), sys.executable, "-m", "nanoslip", *map(str, arguments)]
        return subprocess.run(
            words,
            env=environment | changes,
            capture_output=True,
            text=True,
            timeout=300,
            check=False,
            stdin=subprocess.DEVNULL,
        )

    return command


@pytest.fixture
def main(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Main:
    """Call the command line in this process; returns exit code, standard output and standard error."""
    for name in THREADS:  # a run sets them; this puts them back
        monkeypatch.setenv(name, "1")
    monkeypatch.delenv("COLUMNS", raising=False)

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["nanoslip", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return int(ended.value.code or 0), *capsys.readouterr()

    return call


def polite_signal() -> signal.Signals:
    """What asks all ranks of a launcher to end: SIGTERM, but Open MPI's kills them a moment later."""
    version = subprocess.run([*launcher(1)[:1], "--version"], capture_output=True, text=True, check=False).stdout
    return signal.SIGUSR1 if "Open MPI" in version else signal.SIGTERM


def launcher(ranks: int) -> list[str]:
    """Words that start so many ranks; skips the test where there is no mpiexec."""
    if ranks == 0:
        return []
    beside = Path(sys.executable).with_name("mpiexec")
    found = str(beside) if beside.exists() else shutil.which("mpiexec")
    if found is None:
        pytest.skip("no mpiexec beside this Python nor on PATH: install the extra `mpich`")
    return [found, "-n", str(ranks)]
