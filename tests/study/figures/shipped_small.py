"""Shipped campaigns of figures made small: the same question on a coarser surface, from fewer starts."""

import tomllib
from collections.abc import Mapping
from functools import cache
from typing import Any

import xarray as xr

import nanoslip
from nanoslip.study import shipped

SMALLER: Mapping[str, Mapping[str, Mapping[str, Any]]] = {
    "figures/punch": {"axes": {"n_x": [129, 257]}},
    "figures/records": {"axes": {"start": [0.0, 0.25, 0.5]}, "numerics": {"n_x": 33}, "limits": {"events": 400}},
    "figures/resolution": {"axes": {"n_x": [17, 33, 65]}, "ensemble": {"members": 2}},
    "figures/drive": {"axes": {"start": [0.0, 0.25, 0.5]}, "numerics": {"n_x": 65}, "limits": {"events": 800}},
    "figures/findings": {
        "axes": {"intrinsic_friction": [0.2, 0.5], "start": [number / 8.0 for number in range(8)]},
        "numerics": {"n_x": 65},
        "limits": {"events": 1000},
    },
    "figures/modulation": {
        "axes": {"normal_load": [2.5e-4, 1e-3], "start": [0.0, 0.5]},
        "numerics": {"n_x": 33},
    },
    "figures/continuum": {"axes": {"n_x": [17, 33, 65]}},
    "figures/layers": {"numerics": {"n_x": 33}, "ensemble": {"members": 3}},
    "figures/chain": {"numerics": {"n_x": 33}, "limits": {"events": 1500}, "ensemble": {"members": 1}},
    "interface/preparation": {
        "axes": {"initial_contact": ["stick", "frictionless"], "spread": [0.0, 0.1], "contacts": [1, 4, 16]},
        "numerics": {"n_x": 33},
        "limits": {"presliding": 4.0},
        "ensemble": {"members": 3},
    },
    "interface/shear": {
        "axes": {
            "residual_shear": [0.0, 0.9],
            "intrinsic_friction": [0.2, 0.5],
            "spread": [0.0, 0.1],
            "contacts": [1, 4, 16],
        },
        "numerics": {"n_x": 33},
        "limits": {"presliding": 4.0},
        "ensemble": {"members": 3},
    },
    "maps/slider": {
        "axes": {"loads": ["equal", "exponential"], "contacts": [1, 4]},
        "numerics": {"n_x": 33},
        "limits": {"presliding": 4.0},
        "ensemble": {"members": 3},
        "drive_axes": {"spring_stiffness": [1e6, 1e7], "stage_velocity": [1e-3, 1e-2]},
    },
    "maps/stick_slip": {
        "numerics": {"n_x": 17},
        "drive_axes": {
            "spring_stiffness": [1e5, 1e6],
            "stage_velocity": [1e-4, 1e-2],
            "damping_ratio": [0.01, 0.3],
            "pin_mass": [0.016, 0.5],
        },
    },
    "maps/friction": {
        "axes": {
            "intrinsic_friction": [0.2, 0.5],
            "radius": [50.0, 200.0],
            "aspect_ratio": [1.0, 2.0],
            "normal_load": [5e-4, 1e-3],
        },
        "numerics": {"n_x": 65},
    },
    "schemes": {"axes": {"n_x": [33, 65]}},
    "figures/choices": {
        "axes": {
            "radius": [200.0],
            "support": ["bonded", "right_side"],
            "first_spacing": ["equal"],
            "initial_contact": ["stick"],
            "slip_order": ["worst_first", "simultaneous"],
            "limited_shear": ["both_ways"],
            "event_floor": [1e-6],
            "start": [0.0, 0.5],
        },
        "numerics": {"n_x": 33},
        "limits": {"events": 300},
    },
}
"""Campaign -> keys of its tables that are given other values."""


@cache
def small(campaign: str) -> xr.Dataset:
    """The dataset of a shipped campaign with the values of `SMALLER`."""
    path = shipped.campaigns()[campaign]
    content = tomllib.loads(path.read_text("utf-8"))
    if "table" in content:
        content["table"] = str(path.parent / content["table"])
    for table, changes in SMALLER.get(campaign, {}).items():
        content[table] = {**content.get(table, {}), **changes}
    return nanoslip.run(content)
