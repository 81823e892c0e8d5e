"""One diagram's numbers: a row for each setting, with its time and its errors."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from nanoslip.study.manifest.parameters import Value
from nanoslip.study.plan.grids import pareto_front

Row = Mapping[str, Value]


@dataclass(frozen=True, slots=True)
class Diagram:
    """Rows of one knob or several; every row has the same columns."""

    name: str
    """Dimension of the rows in the dataset, and the first word of their variables."""
    title: str
    reference: str
    """What the errors are held against."""
    series: str
    """Column whose values tell curves of a diagram apart."""
    shown: tuple[str, ...]
    """Columns of its table; an uncertainty is shown with its value."""
    error: str
    """Column of the error in the diagram; empty where rows are not to be compared."""
    rivals: bool
    """Whether rows of different series compete: where they do not answer the same question each has its own front."""
    words: Mapping[str, str]
    """Every column -> its meaning."""
    rows: tuple[Row, ...]

    @property
    def groups(self) -> list[NDArray[np.bool_]]:
        """Masks of the rows that are rivals."""
        if self.rivals:
            return [np.ones(len(self.rows), dtype=np.bool_)]
        series = self.column(self.series)
        return [series == name for name in dict.fromkeys(series.tolist())]

    @property
    def on_front(self) -> NDArray[np.bool_]:
        """Which rows no rival beats in time and error."""
        marked = np.zeros(len(self.rows), dtype=np.bool_)
        if not self.error:
            return marked
        time, error = self.column("seconds"), self.column(self.error)
        for group in self.groups:
            marked[group] = pareto_front(time[group], error[group])
        return marked

    def column(self, name: str) -> NDArray[np.generic]:
        """One column, shape (rows,)."""
        return np.array([row[name] for row in self.rows], dtype=object if name in self.texts else None)

    @property
    def texts(self) -> frozenset[str]:
        """Columns of words."""
        return frozenset(name for row in self.rows for name, value in row.items() if isinstance(value, str))

    def variables(self) -> dict[str, xr.Variable]:
        """The columns as variables of a dataset, and which rows are on the front."""
        found = {
            f"{self.name}_{name}": xr.Variable(self.name, self.column(name), {"long_name": words, "units": _unit(name)})
            for name, words in self.words.items()
        }
        if not self.error:
            return found
        attributes = {"long_name": f"no other row beats it in time and {self.error}", "units": "1"}
        return found | {f"{self.name}_on_front": xr.Variable(self.name, self.on_front.astype(np.int8), attributes)}


def _unit(name: str) -> str:
    return "s" if name in ("seconds", "time_step") else "1"
