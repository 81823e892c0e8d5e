"""All figures: importing this file registers them, in the order of the imports."""

from nanoslip.study.figures.reproduction import punch, records, resolution, drive, motion, choices  # noqa: I001  the paper's order
from nanoslip.study.figures.further import findings, modulation, continuum, sizes, correlations, nodes
from nanoslip.study.figures.further import stick_slip_map, friction_map, schemes
from nanoslip.study.figures.shared import FIGURES

__all__ = [
    "FIGURES",
    "choices",
    "continuum",
    "correlations",
    "drive",
    "findings",
    "friction_map",
    "modulation",
    "motion",
    "nodes",
    "punch",
    "records",
    "resolution",
    "schemes",
    "sizes",
    "stick_slip_map",
]
