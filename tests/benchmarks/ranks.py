"""Start a benchmark's own program on several ranks, and read what its root found."""

import json
import os
import subprocess
import sys
from typing import Any

from tests.conftest import launcher


def started(ranks: int, module: str, *arguments: object, **changes: str) -> str:
    """Standard output of `python -m module arguments` on so many ranks. Raises RuntimeError with what went wrong."""
    words = [*launcher(ranks), sys.executable, "-m", module, *map(str, arguments)]
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PMI", "OMPI", "SLURM"))}
    done = subprocess.run(words, env=environment | changes, capture_output=True, text=True, timeout=300, check=False)
    if done.returncode:
        raise RuntimeError(f"{' '.join(words)}: exit code {done.returncode}\n{done.stderr}")
    return done.stdout


def found(ranks: int, module: str, *arguments: object, **changes: str) -> Any:
    """The JSON that the root prints last."""
    return json.loads(started(ranks, module, *arguments, **changes).splitlines()[-1])
