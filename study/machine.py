"""The machine and its numerical libraries, for the journal of a run. Those that decide last bits are written into results too."""

import os
import platform
import socket
import sys
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from nanoslip.study import provenance

LIBRARIES: Final = (*provenance.LIBRARIES, "mpi4py")
_DECIDING: Final = ("sse", "ssse", "avx", "fma", "amx", "asimd", "sve", "vsx")
"""How the features of a processor begin that can change a last bit: kernels and libraries choose their code by them."""


@dataclass(frozen=True, slots=True)
class Machine:
    """One machine, as a process on it sees it."""

    host: str
    processor: str
    """Its model."""
    features: str
    """Its instructions for vectors and matrices."""
    blas: str
    """The libraries of linear algebra that are loaded: version, and the kernel that each has chosen for this processor."""
    mpi: str
    """The MPI library and its version; empty without one."""
    python: str
    libraries: dict[str, str]
    """Name -> version."""


def this_machine() -> Machine:
    """What computes here, as far as it is loaded: a BLAS is once numpy is."""
    return Machine(
        host=socket.gethostname(),
        processor=model(),
        features=features(),
        blas=blas(),
        mpi=_mpi(),
        python=platform.python_version(),
        libraries={name: provenance.installed(name) for name in LIBRARIES},
    )


def model() -> str:
    """The processor's model, as Linux says it; elsewhere no more than the architecture."""
    return _processor(("model name",)) or platform.machine()


def features() -> str:
    """The processor's deciding features, as Linux says them; elsewhere no more than the architecture."""
    words = _processor(("flags", "features")).split()
    return " ".join(sorted(word for word in words if word.startswith(_DECIDING))) or platform.machine()


def _processor(names: tuple[str, ...]) -> str:
    """What the first processor says under the first of these names that is there; else empty."""
    said: dict[str, str] = {}
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text("utf-8", errors="replace").splitlines():
            name, _, value = line.partition(":")
            said.setdefault(name.strip().lower(), value.strip())
    return next((said[name] for name in names if said.get(name)), "")


def blas() -> str:
    """The libraries of linear algebra that are loaded, each with the kernel it has chosen; empty before numpy is."""
    return ", ".join(sorted(set(_blas())))


def _blas() -> Iterator[str]:
    if "numpy" not in sys.modules:
        return
    import threadpoolctl  # noqa: PLC0415  of use once a BLAS is loaded

    for library in threadpoolctl.threadpool_info():
        if library["user_api"] == "blas":
            facts = (library["internal_api"], library["version"], library.get("architecture"))
            yield " ".join(str(fact) for fact in facts if fact)


def _mpi() -> str:
    """Of the library that this process has loaded and several ranks use; nothing is loaded for it."""
    mpi: Any = sys.modules.get("mpi4py.MPI")
    if mpi is None or mpi.Is_finalized() or mpi.COMM_WORLD.Get_size() == 1:
        return ""
    return " ".join(str(mpi.Get_library_version()).replace("\0", "").split("\n", maxsplit=1)[0].split())


def user() -> str:
    """Name of whoever runs this process; its number where that has no name."""
    with suppress(OSError, ImportError, KeyError):
        import pwd  # noqa: PLC0415  not everywhere

        return pwd.getpwuid(os.getuid()).pw_name
    return str(os.getuid()) if hasattr(os, "getuid") else ""
