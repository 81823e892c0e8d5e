"""Provenance of a result: the software that made it. No clock, host or rank."""

import json
import os
import subprocess
import tomllib
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

from nanoslip.study.shipped import COPIES

DISTRIBUTION = "nanoslip"
LIBRARIES = ("numpy", "scipy", "numba", "xarray", "netCDF4")
UNKNOWN = "unknown"
BUILT_FROM = "source_commit"
"""File beside the copies of `nanoslip.study.shipped` that names the commit a wheel was built from."""


def version(root: Path | None = None) -> str:
    """Version of this package: of the source tree it was imported from, else of the installed distribution."""
    description = (root or _source_root()) / "pyproject.toml"
    if description.is_file():
        content = tomllib.loads(description.read_text("utf-8"))
        project = content.get("project", {})
        if project.get("name") == DISTRIBUTION:
            return str(project["version"])
    return distribution_version(DISTRIBUTION)


def source_commit(root: Path | None = None, within: Iterable[Path] = ()) -> str:
    """Commit of the source tree this package was imported from, "+modified" if tracked files differ (`within`: those files only).

    Outside a checkout: the commit of the wheel, or that pip recorded on installation; else "unknown".
    """
    tree = root or _source_root()
    if not (tree / ".git").exists():
        return _wheel_commit(tree) or _read_installed_commit()
    commit = _git(tree, "rev-parse", "HEAD")
    if commit is None:
        return UNKNOWN
    # Untracked files would make every checkout with results in it a modified one.
    options = ("--porcelain", "--untracked-files=no")
    changes = _git(tree, "status", *options, "--", *map(str, within))
    return f"{commit}+modified" if changes else commit


def _source_root() -> Path:
    return Path(__file__).resolve().parent.parent


def _git(tree: Path, *arguments: str) -> str | None:
    # A git hook exports GIT_DIR and the like, which would answer for another repository.
    environment = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = ["git", "-C", str(tree), *arguments]
    try:
        # A lock or a slow network file system must not hold up a run for what is only recorded.
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=30, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return done.stdout.strip()


def distribution_version(name: str) -> str:
    """Version of an installed distribution, or "unknown"."""
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return UNKNOWN


def _wheel_commit(root: Path) -> str:
    """The commit that a wheel names; empty if there is none."""
    path = root / "study" / COPIES / BUILT_FROM
    return path.read_text("utf-8").strip() if path.is_file() else ""


def _read_installed_commit() -> str:
    try:
        record = metadata.distribution(DISTRIBUTION).read_text("direct_url.json")
    except metadata.PackageNotFoundError:
        return UNKNOWN
    facts = json.loads(record or "{}")
    return str(facts.get("vcs_info", {}).get("commit_id", UNKNOWN))
