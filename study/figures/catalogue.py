"""All figures: importing this file registers them, in the order of the imports."""

from study.figures.reproduction import punch, records, resolution, drive, motion, choices  # noqa: I001  the paper's order
from study.figures.further import findings, modulation, continuum, sizes, stick_slip_map, friction_map, schemes
from study.figures.shared.figure import FIGURES

__all__ = [
    "FIGURES",
    "choices",
    "continuum",
    "drive",
    "findings",
    "friction_map",
    "modulation",
    "motion",
    "punch",
    "records",
    "resolution",
    "schemes",
    "sizes",
    "stick_slip_map",
]
