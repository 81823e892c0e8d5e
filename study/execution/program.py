"""What a process is to compute with: named, so that whoever hands it on need not import it."""

from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any


@dataclass(frozen=True, slots=True)
class Settle:
    """The last task of a process: to write out what it has computed, so that other machines see it."""

    key: str = "settle"
    needs: tuple[str, ...] = ()
    kind: str = "settle"
    cost: float = 0.01
    limit: float = 60.0
    label: str = "writing results out"


@dataclass(frozen=True, slots=True)
class Program:
    """A function of a module that, called with the argument, returns the function that computes a task."""

    module: str
    name: str
    argument: Any = None

    def load(self) -> Callable[[Any], Any]:
        """The function that computes a task. Imports the module."""
        make: Callable[[Any], Callable[[Any], Any]] = getattr(import_module(self.module), self.name)
        return make(self.argument)


def computing(out: Path) -> Program:
    """What computes the tasks of a campaign, with the results in this folder, wherever a task leads its process."""
    return Program("nanoslip.study.execution.executor", "executor", out.absolute())
