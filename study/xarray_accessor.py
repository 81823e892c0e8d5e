"""`.nanoslip` of every `xr.Dataset`, as soon as xarray is imported; neither is imported for it.

The accessor and the solver are imported at the first use of `.nanoslip`.
"""

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any, Final

NAME: Final = "nanoslip"


def register() -> None:
    """Make xarray know the accessor: now, where xarray is imported, else when it will be. More than once does no harm."""
    xarray = sys.modules.get("xarray")
    if xarray is not None and hasattr(xarray, "register_dataset_accessor"):
        _add_to(xarray)
    elif not any(isinstance(finder, _Awaiting) for finder in sys.meta_path):
        sys.meta_path.insert(0, _Awaiting())


def accessor(dataset: Any) -> Any:
    """Records, trajectories, contacts and events of a dataset: `nanoslip.study.dataset.access.Accessor`."""
    return import_module("nanoslip.study.dataset.access").Accessor(dataset)


def _add_to(xarray: ModuleType) -> None:
    if not hasattr(xarray.Dataset, NAME):
        xarray.register_dataset_accessor(NAME)(accessor)


class _Awaiting:
    """Finds xarray as the other finders of `sys.meta_path` do, and registers the accessor once it is imported."""

    def find_spec(self, name: str, path: Sequence[str] | None, target: ModuleType | None = None) -> ModuleSpec | None:
        if name != "xarray":
            return None
        others = (finder for finder in sys.meta_path if finder is not self)
        spec = next((found for finder in others if (found := finder.find_spec(name, path, target))), None)
        if spec is not None and spec.loader is not None:
            self._follow(spec.loader)
        return spec

    def _follow(self, loader: Any) -> None:
        execute = loader.exec_module

        def execute_and_register(module: ModuleType) -> None:
            execute(module)
            if self in sys.meta_path:
                sys.meta_path.remove(self)
            _add_to(module)

        loader.exec_module = execute_and_register
