"""Shipped campaigns of figures made small: the same question on a coarser surface, from fewer starts."""

import fcntl
import hashlib
import tomllib
from collections.abc import Mapping
from functools import cache
from pathlib import Path

import xarray as xr

import nanoslip
from nanoslip.study import shipped

KINDS = [
    (*body, initial_contact, spread, contacts)
    for body in (
        *(("half_plane", n_x, 7.363e-4) for n_x in (33, 145)),
        *(("half_space", n_x, 3.125e-4) for n_x in (17, 25)),
    )
    for initial_contact, spread in (("stick", 0.0), ("gradual", 0.0), ("stick", 0.1))
    for contacts in (1, 8, 64)
    if (initial_contact == "stick" or body[1] == 145) and not (spread and body[1] == 17)
]
"""Contacts of small intrinsic friction, as a table of cases would have them."""
EXCESS = (
    "table = ''\ndesign = 'zip'\nensemble.members = 2\nlimits.presliding = 3\nconstants.intrinsic_friction = 0.05\n[axes]\n"
    + "\n".join(
        f"{name} = {list(values)}"
        for name, values in zip(
            ("scheme", "n_x", "normal_load", "initial_contact", "spread", "contacts"),
            zip(*KINDS, strict=True),
            strict=True,
        )
    )
)
SMALLER: Mapping[str, str] = {
    "figures/punch": "axes.n_x = [129, 257]",
    "figures/records": "axes.start = [0.0, 0.25, 0.5]\nnumerics.n_x = 33\nlimits.events = 400",
    "figures/resolution": "axes.n_x = [17, 33, 65]\nensemble.members = 2",
    "figures/drive": "axes.start = [0.0, 0.25, 0.5]\nnumerics.n_x = 65\nlimits.events = 800",
    "figures/findings": "axes = {intrinsic_friction = [0.2, 0.5], start = [0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875]}\n"
    "numerics.n_x = 65\nlimits.events = 1000",
    "figures/modulation": "axes = {normal_load = [2.5e-4, 1e-3], start = [0.0, 0.5]}\nnumerics.n_x = 33",
    "figures/continuum": "axes.n_x = [17, 33, 65]",
    "figures/layers": "numerics.n_x = 33\nensemble.members = 3",
    "figures/strength": "numerics.n_x = 17\nlimits.presliding = 4\nensemble.members = 2",
    "figures/chain": "numerics.n_x = 33\nlimits.events = 700\nensemble.members = 1",
    "interface/preparation": "axes = {initial_contact = ['stick', 'frictionless'], spread = [0.0, 0.1], contacts = [1, 4, 16]}\n"
    "numerics.n_x = 33\nlimits.presliding = 4.0\nensemble.members = 3",
    "interface/shear": "axes.residual_shear = [0.0, 0.9]\naxes.intrinsic_friction = [0.2, 0.5]\naxes.spread = [0.0, 0.1]\n"
    "axes.contacts = [1, 4, 16]\nnumerics.n_x = 33\nlimits.presliding = 4.0\nensemble.members = 2",
    "maps/slider": "axes = {loads = ['equal', 'exponential'], contacts = [1, 4]}\nnumerics.n_x = 33\nlimits.presliding = 4.0\n"
    "ensemble.members = 2\ndrive_axes = {spring_stiffness = [1e7, 1e8], stage_velocity = [1e-3, 1e-2]}\n"
    "drives = [{name = 'stage', stage_travel = 1e-4, max_slips = 60, samples = 1}]",
    "maps/stick_slip": "numerics.n_x = 17\n[drive_axes]\nspring_stiffness = [1e5, 1e6]\nstage_velocity = [1e-4, 1e-2]\n"
    "damping_ratio = [0.01, 0.3]\npin_mass = [0.016, 0.5]",
    "maps/friction": "numerics.n_x = 65\n[axes]\nintrinsic_friction = [0.2, 0.5]\nradius = [50.0, 200.0]\n"
    "aspect_ratio = [1.0, 2.0]\nnormal_load = [5e-4, 1e-3]",
    "paths/reversal": "axes = {scheme = ['biquadratic', 'strip'], n_x = [33, 65], start = [0.0, 0.25, 0.5]}",
    "paths/pulse": "axes = {scheme = ['biquadratic', 'strip'], n_x = [33, 65], start = [0.0, 0.25, 0.5]}",
    "paths/swing": "axes = {scheme = ['biquadratic', 'strip'], n_x = [65, 129], start = [0.0, 0.125, 0.25, 0.5, 0.75]}",
    "paths/coulomb": "axes.n_x = [17, 33]\nensemble.members = 3",
    "paths/memory": "axes = {scheme = ['galerkin', 'strip'], start = [0.0, 0.25, 0.5]}\nnumerics.n_x = 65",
    "findings/plateau": "table = ''\ndesign = 'zip'\nlimits.presliding = 4\nensemble.members = 3\n[axes]\n"
    "scheme = ['strip', 'strip', 'half_space', 'half_space']\nn_x = [129, 129, 33, 33]\n"
    "normal_load = [1e-3, 1e-3, 3.125e-4, 3.125e-4]\nresidual_shear = [0.0, 0.6, 0.0, 0.6]",
    "findings/disorder": "table = ''\ndesign = 'zip'\nlimits.presliding = 4\nensemble.members = 6\n[axes]\n"
    "scheme = ['half_space', 'half_space', 'half_space', "
    "'half_plane', 'half_plane', 'half_plane', 'half_plane', 'half_plane', 'half_plane']\n"
    "n_x = [33, 33, 33, 33, 33, 33, 407, 407, 407]\nspread = [0.0, 0.1, 0.3, 0.0, 0.1, 0.3, 0.0, 0.1, 0.3]\n"
    "normal_load = [3.125e-4, 3.125e-4, 3.125e-4, 7.363e-4, 7.363e-4, 7.363e-4, 7.363e-4, 7.363e-4, 7.363e-4]",
    "findings/excess": EXCESS,
    "findings/shares": "axes = {n_x = [129], spread = [0.0, 0.1], start = [0.0131, 0.2631, 0.5131, 0.7631]}\n"
    "limits.events = 3100\noutputs.tractions_at = [3000, 3001, 3002, 3100]",
    "findings/fine": "axes = {n_x = [33, 65, 129], start = [0.0, 0.25, 0.5, 0.75]}",
    "findings/edge": "interface.contacts = 8\nensemble.members = 3",
    "paths/control": "axes.aspect_ratio = [1.0, 0.25]\nnumerics.n_x = 33\npath.amplitude = [0.2, 0.45]\npath.cycles = 6\n"
    "ensemble.members = 3",
    "findings/shares_ball": "axes = {spread = [0.0], start = [0.0, 0.25, 0.5]}\nnumerics.n_x = 25\n"
    "limits.events = 2600\noutputs.tractions_at = [2600]",
    "figures/scene": "axes = {normal_load = [1e-4, 1e-3], intrinsic_friction = [0.25, 0.5], support = ['bonded', 'right_side'], "
    "start = [0.0, 0.25, 0.5]}\ndrive_axes.stage_velocity = [2e-4, 2e-3]",
    "figures/releases": "axes = {strength = [0.0, 1e-7, 1e-6], start = [0.0, 0.25, 0.5, 0.75]}",
    "figures/similar": "axes.start = [0.0, 0.25, 0.5, 0.75]",
    "findings/ball": "axes.n_x = [17, 33]\nensemble.members = 3",
    "findings/extension": "axes.start = [0.0, 0.25, 0.5, 0.75]\nlimits.spacings = 4",
    "findings/critical": "axes = {scheme = ['galerkin', 'strip'], start = [0.0, 0.5]}\nnumerics.n_x = 65",
    "paths/loss": "axes = {scheme = ['biquadratic', 'half_plane'], n_x = [33, 65]}\nensemble.members = 3",
    "schemes": "axes.n_x = [33, 65]",
    "figures/choices": "numerics.n_x = 33\nlimits.events = 300\n[axes]\nnormal_load = [1e-3]\nfirst_spacing = ['equal']\n"
    "support = ['bonded', 'right_side']\ninitial_contact = ['stick']\nslip_order = ['worst_first', 'simultaneous']\n"
    "limited_shear = ['both_ways']\nstart = [0.0, 0.5]\n[drive_axes]\nstage_velocity = [2e-3]",
}
"""Campaign -> keys that are given other values."""


class Shared:
    """Where the processes of one test run keep results that several of them need; set by the conftest beside this file."""

    folder: Path


@cache
def small(campaign: str, form: str = "") -> xr.Dataset:
    """The dataset of a shipped campaign with the values of a form; those of `SMALLER` without one."""
    path = shipped.campaign_files()[campaign]
    content = tomllib.loads(path.read_text("utf-8"))
    for place, key in ((content, "table"), (content.get("path", {}), "legs")):
        if key in place:
            place[key] = str(path.parent / place[key])
    for table, changes in tomllib.loads(form or SMALLER.get(campaign, "")).items():
        content[table] = {**content.get(table, {}), **changes} if isinstance(changes, Mapping) else changes
    if not content.get("table", "as it is"):
        del content["table"]
    out = Shared.folder / hashlib.sha256(f"{campaign} {form}".encode()).hexdigest()[:20]
    with out.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # the first computes, the others find it done
        return nanoslip.run(content, out).load()
