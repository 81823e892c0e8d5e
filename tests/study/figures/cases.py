"""Made-up datasets, laid out as `nanoslip.study.dataset.collect` does: a product of axes, or a list of cases."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr


def product(value: Any = None, **axes: Sequence[Any]) -> xr.Dataset:
    """A full product of axes. value: of plateau_mean, a function of a coordinate's arrays; 0.5 μ_i where there is none."""
    dims = tuple(axes)
    shape = tuple(map(len, axes.values()))
    coordinates = {
        name: np.array(values, dtype=object if isinstance(values[0], str) else None) for name, values in axes.items()
    }
    grid = dict(zip(dims, np.meshgrid(*coordinates.values(), indexing="ij"), strict=True))
    plateau = 0.5 * grid["intrinsic_friction"] if value is None else value(**grid)
    ids = np.array([f"case{number}" for number in range(plateau.size)], dtype=object).reshape(shape)
    return _dataset(dims, plateau, {**coordinates, "case_id": (dims, ids)})


def listed(columns: Mapping[str, Sequence[Any]], plateau: Sequence[float], manifest: str = "") -> xr.Dataset:
    """A list of cases. columns: coordinates along it."""
    labels = {name: ("case", np.array(values)) for name, values in columns.items()}
    ids = ("case", np.array([f"case{number}" for number in range(len(plateau))], dtype=object))
    found = _dataset(("case",), np.array(plateau), {"case": np.arange(len(plateau)), "case_id": ids, **labels})
    found.attrs["manifest"] = manifest
    return found


def _dataset(dims: tuple[str, ...], plateau: np.ndarray, coordinates: Mapping[str, Any]) -> xr.Dataset:
    words = np.where(np.isfinite(plateau), "completed", "no_plateau").astype(object)
    return xr.Dataset(
        {
            "plateau_mean": (dims, plateau),
            "plateau_mean_uncertainty": (dims, 0.01 * np.abs(plateau)),
            "outcome": (dims, words),
            "message": (dims, np.full(plateau.shape, "", dtype=object)),
            "validity_flags": (dims, np.zeros(plateau.shape, dtype=np.int32)),
        },
        coordinates,
        {"title": "Made up"},
    )


def regimes(over: Sequence[str], words: Sequence[str] = ("slides", "stick_slip")) -> xr.Dataset:
    """Made-up regimes in turn over radii and, with a second name, loads."""
    values = {"radius": [50.0, 100.0, 200.0], "normal_load": [1e-4, 1e-3]}
    found = product(lambda radius, **_: 0.5 * radius, **{name: values[name] for name in over})
    shape, count = found["plateau_mean"].shape, found["plateau_mean"].size
    texts = np.array([words[number % len(words)] for number in range(count)], dtype=object)
    return found.assign(regime=(tuple(over), texts.reshape(shape)))
