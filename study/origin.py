"""Software that computed a result: the same description on every host and rank, at any time.

Identity: a hash of the contents of the solver and of the two files that declare and call a computation. Commit, BLAS kernels
and instructions of the processor are recorded but not part of it: on a newer machine nothing is computed again.
"""

import hashlib
import importlib.util
import os
import platform
import socket
import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from importlib import import_module
from importlib.machinery import ModuleSpec
from pathlib import Path
from typing import Any, Final

from nanoslip.study import processor, provenance
from nanoslip.study.canonical import content_hash
from nanoslip.study.provenance import UNKNOWN

# The machine and its numerical libraries, for the journal of a run. Those that decide last bits are written into results too.

BLAS_LIBRARIES: Final = (*provenance.LIBRARIES, "mpi4py")
_DECIDING: Final = ("sse", "ssse", "avx", "fma", "amx", "asimd", "sve", "vsx")
"""Prefixes of processor features that can change a last bit: kernels and libraries choose their code by them."""

SETTINGS: Final = (
    "OPENBLAS_L2_SIZE",
    *("NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_ENABLE_AVX", "NUMBA_DISABLE_JIT"),
    *("NUMBA_OPT", "NUMBA_LOOP_VECTORIZE", "NUMBA_SLP_VECTORIZE"),
)
"""Environment variables that change the code that numba makes of the same source, or the blocks of OpenBLAS."""


def this_machine() -> dict[str, Any]:
    """Processor and loaded libraries, for a journal; the BLAS is known after numpy is imported."""
    return {
        "host": socket.gethostname(),
        "processor": model(),
        "features": features(),
        "blas": blas(),
        "mpi": _mpi(),
        "python": platform.python_version(),
        "libraries": {name: provenance.distribution_version(name) for name in BLAS_LIBRARIES},
    }


def model() -> str:
    """Model of the processor, from Linux; elsewhere the architecture only."""
    return processor.model() or platform.machine()


def features() -> str:
    """Features of the processor that change bits, from Linux, elsewhere the architecture; and SETTINGS."""
    deciding = [word for word in processor.instructions() if word.startswith(_DECIDING)]
    instructions = sorted(deciding) or [platform.machine()]
    settings = [f"{name}={os.environ[name]}" for name in SETTINGS if os.environ.get(name)]
    return " ".join((*instructions, *settings))


def blas() -> str:
    """The libraries of linear algebra that are loaded, each with the kernel it has chosen; empty before numpy is."""
    if "numpy" not in sys.modules:
        return ""
    import threadpoolctl  # noqa: PLC0415  of use once a BLAS is loaded

    loaded = [library for library in threadpoolctl.threadpool_info() if library["user_api"] == "blas"]
    facts = [(library["internal_api"], library["version"], library.get("architecture")) for library in loaded]
    # numpy and scipy may have loaded a copy each of the same library.
    texts = {" ".join(map(str, filter(None, library))) for library in facts}
    return ", ".join(sorted(texts))


def _mpi() -> str:
    """Version of the MPI library that this process has loaded and several ranks use; loads none."""
    mpi: Any = sys.modules.get("mpi4py.MPI")
    if mpi is None or mpi.Is_finalized() or mpi.COMM_WORLD.Get_size() == 1:
        return ""
    version = str(mpi.Get_library_version()).replace("\0", "")
    first_line = version.split("\n", maxsplit=1)[0]
    return " ".join(first_line.split())


def user() -> str:
    """Name of the user of this process; the user's number if there is no name."""
    with suppress(OSError, ImportError, KeyError):
        import pwd  # noqa: PLC0415  not everywhere

        return pwd.getpwuid(os.getuid()).pw_name
    return str(os.getuid()) if hasattr(os, "getuid") else ""


SOLVER: Final = "nanoslip.solver"
TASKS: Final = "nanoslip.study.tasks"
"""The package beside the solver that makes numbers."""


_DECIDED_BY: Final = ("source_hash", "numpy_version", "scipy_version", "numba_version")


@dataclass(frozen=True, slots=True, order=True)
class Origin:
    """State of the software. Results of two origins that are `alike` do not differ in any software that computes."""

    nanoslip_version: str = UNKNOWN
    source_hash: str = UNKNOWN
    """Hash (16 hexadecimal digits) of the files that decide results: their contents count, names and folders do not."""
    source_commit: str = UNKNOWN
    """The commit, "+modified" where the files that decide results differ from it."""
    python_version: str = UNKNOWN
    numpy_version: str = UNKNOWN
    scipy_version: str = UNKNOWN
    numba_version: str = UNKNOWN
    blas: str = UNKNOWN
    """The libraries of linear algebra: version, and the kernel that each has chosen for the processor."""
    processor_features: str = UNKNOWN
    """The processor's instructions for vectors and matrices, by which kernels and libraries choose their code."""

    @property
    def name(self) -> str:
        """A short name: a hash of its description (8 hexadecimal digits)."""
        return content_hash(self, length=8)

    @property
    def deciding(self) -> tuple[str, ...]:
        """Properties that may change a number: source and computing libraries; texts do not count as source."""
        return tuple([getattr(self, name) for name in _DECIDED_BY])

    def differences(self, other: "Origin") -> dict[str, tuple[str, str]]:
        """Name of each property that decides results -> its two values, where they differ."""
        values = zip(_DECIDED_BY, self.deciding, other.deciding, strict=True)
        return {name: (mine, theirs) for name, mine, theirs in values if mine != theirs}

    @property
    def solver(self) -> str:
        """A short name of source and libraries (8 hexadecimal digits), the same on every machine."""
        return content_hash(list(self.deciding), length=8)

    def alike(self, other: "Origin") -> bool:
        """True if both compute the same; unknown origins equal none."""
        return UNKNOWN not in self.deciding and self.deciding == other.deciding

    @property
    def arithmetic(self) -> str:
        """Properties that change last bits for the same software.

        With one kernel of BLAS all processors with AVX2 and FMA compute the same bits: more instructions change none.
        """
        features = self.processor_features.split()
        if {"avx2", "fma"} <= set(features):
            # Settings of the environment stay, as they change the code that is made for any processor.
            features = ["avx2", "fma", *(word for word in features if "=" in word)]
        return f"{self.blas}, on {' '.join(features)}"

    def same_bits(self, other: "Origin") -> bool:
        """True if both compute the same to the last bit."""
        return self.alike(other) and self.arithmetic == other.arithmetic

    def __str__(self) -> str:
        return (
            f"nanoslip {self.nanoslip_version}, source {self.source_hash}, commit {self.source_commit}, "
            f"numpy {self.numpy_version}, scipy {self.scipy_version}, numba {self.numba_version}"
        )


Origins = tuple[Origin, ...]
"""All software that a result stems from, its inputs' included: sorted, each once."""

NOBODY: Final = Origin()
"""Origin of a result without a description of its software."""


@lru_cache(maxsize=1)
def here() -> Origin:
    """Version of this program; BLAS and CPU features are known only after the first computation (`computing_origin`).

    Runs git, a separate process: call it before MPI starts. The root of a run calls it, and all other processes
    `adopt` the answer.
    """
    if _adopted:
        return _adopted[0]
    return replace(find_software(), source_commit=provenance.source_commit(within=source_files()))


def adopt(origin: Origin) -> None:
    """Adopt the origin found by the root of a run."""
    _adopted[:] = [origin]
    here.cache_clear()
    computing_origin.cache_clear()


_adopted: list[Origin] = []


def find_software() -> Origin:
    """Software that this process would load now; does not run git."""
    versions = {f"{name}_version": provenance.distribution_version(name) for name in ("numpy", "scipy", "numba")}
    return Origin(
        nanoslip_version=provenance.version(),
        source_hash=source_hash(source_files()),
        python_version=platform.python_version(),
        **versions,
    )


@lru_cache(maxsize=1)
def computing_origin() -> Origin:
    """Version of this program with the BLAS and CPU features that it computes with."""
    return replace(here(), **arithmetic())


@lru_cache(maxsize=1)
def arithmetic() -> dict[str, str]:
    """Software and hardware of arithmetic: the BLAS of numpy and scipy, which is loaded, and the processor's features."""
    # Else the task that happens to come first would decide which libraries are loaded.
    import_module("scipy.linalg")
    return {"blas": blas(), "processor_features": features()}


def source_files() -> tuple[Path, ...]:
    """The files that decide results."""
    return tuple(_list_sources(SOLVER, TASKS))


@lru_cache(maxsize=1)
def all_sources_hash() -> str:
    """Hash of the whole program; each file may change how results are collected."""
    return source_hash(_list_sources(SOLVER, __package__))


def _list_sources(*packages: str) -> Iterator[Path]:
    """All files of these packages."""
    for package in packages:
        for folder in _folders(package):
            yield from Path(folder).rglob("*.py")


def _folders(package: str) -> list[str]:
    """Folders of a package: git follows no links."""
    locations = _locate_package(package).submodule_search_locations or ()
    return [os.path.realpath(folder) for folder in locations]


def _locate_package(module: str) -> ModuleSpec:
    spec = importlib.util.find_spec(module)
    # Without the package this line would not run.
    assert spec is not None
    return spec


def source_hash(files: Iterable[Path]) -> str:
    """Hash of the contents of files, whatever they are called, in whatever order and with whatever line ends they come."""
    # Sorted by content: names and folders decide nothing. Git on Windows writes other line ends.
    texts = (path.read_bytes().replace(b"\r\n", b"\n") for path in files)
    contents = sorted(hashlib.sha256(text).hexdigest() for text in texts)
    return content_hash(contents, length=16)


def stemming(*parts: Origins) -> Origins:
    """Origins of a result made of these."""
    return tuple(sorted({origin for part in parts for origin in part}))


def from_data(entries: Iterable[Mapping[str, str]]) -> Origins:
    """Origins from plain data; missing entries are unknown."""
    facts_known = {item.name for item in fields(Origin)}
    origins = []
    for entry in entries:
        facts = {name: fact for name, fact in entry.items() if name in facts_known}
        origins.append(Origin(**facts))
    return tuple(origins)


def foreign(origins: Origins, home: Origin) -> bool:
    """True if other software than `home` contributed to a result."""
    return not origins or not all(origin.alike(home) for origin in origins)


def foreign_among(results: Mapping[str, Origins]) -> dict[str, Origins]:
    """Results that depend on other software than the present one."""
    home = here()
    # Each combination once: of millions of results there are few.
    is_foreign = {origins: foreign(origins, home) for origins in set(results.values())}
    return {key: origins for key, origins in results.items() if is_foreign[origins]}


def census(results: Iterable[Origins]) -> Counter[Origin]:
    """Count results by the software that made them; a result made by several counts for each."""
    return Counter(origin for origins in results for origin in (origins or (NOBODY,)))


def mixture(counts: Mapping[Origin, int]) -> str:
    """List all origins with their counts in one line, if their bits differ; else empty."""
    first = next(iter(counts), NOBODY)
    if all(origin == first or origin.same_bits(first) for origin in counts):
        return ""
    said = {origin: f"{origin}, {origin.arithmetic}" for origin in counts}
    if len({origin.arithmetic for origin in counts}) == 1:
        said = {origin: f"{origin}" for origin in counts}
    frequent = sorted(counts, key=lambda origin: (-counts[origin], origin))
    parts = (f"{counts[origin]} of {said[origin]}" for origin in frequent)
    deciding = {origin.deciding for origin in counts}
    what = "processors" if len(deciding) == 1 else "software"
    return f"results of different {what}: " + "; ".join(parts)
