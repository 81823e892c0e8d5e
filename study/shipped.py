"""Campaigns and cluster settings that come with nanoslip, in the source tree or as copies in an installed package."""

import os
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent
COPIES = "shipped"
"""Folder of this package that holds the copies. Only an installed package has it; setup.py makes it."""
DATA = {"campaigns": ("*.toml", "*.csv", "*.py"), "slurm": ("*.toml", "*.j2")}
"""Folder of the source tree -> its files that are copied."""


def folder(name: str) -> Path:
    """The folder `campaigns` or `slurm`."""
    copies = _PACKAGE / COPIES
    return (copies if copies.is_dir() else _PACKAGE.parent) / name


def campaign_files() -> dict[str, Path]:
    """Name of each campaign that comes with nanoslip -> its file."""
    root = folder("campaigns")
    paths = sorted(root.rglob("*.toml"))
    return {path.relative_to(root).with_suffix("").as_posix(): path for path in paths}


def starters() -> dict[str, Path]:
    """Name of each campaign that is there to be copied and changed -> its file."""
    files = campaign_files().items()
    return {Path(name).name: path for name, path in files if name.startswith("starters/")}


def campaign_file(path: Path) -> Path:
    """Campaign file by path or name: an existing file takes precedence over a shipped campaign with the same name."""
    # `Path.exists` raises an error for a name that is too long to be one, as a whole text of a campaign.
    if os.path.exists(path):
        return path
    return campaign_files().get(path.as_posix(), path)
