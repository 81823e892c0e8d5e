"""All figures: importing this file registers them, in the order of the imports."""

from study.figures import records, resolution, drive, motion  # noqa: I001  the order of the paper
from study.figures.figure import FIGURES

__all__ = ["FIGURES", "drive", "motion", "records", "resolution"]
