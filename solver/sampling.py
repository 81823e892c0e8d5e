"""What a stretch of a friction record can know of a mean: a model of its uncertainty, measured over cases and starts.

What the pin meets repeats with the nodes of the surface, so all that is read off a record depends on where in a node spacing
the pin is, and one spacing is the longest correlation length there is. Over a stretch that is shorter, blocks agree
with each other and say nothing of the rest of the spacing: what they miss is taken from the model here. Over whole spacings
the modulation averages out, and what is left of it falls as one over their number. Constants and how well the result keeps
its promise: tests/verification/calibration.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

MODULATION: Final = 0.30
"""Standard deviation of the friction force over a node spacing, of its mean, times nodes in contact over what a slip drops."""
EVENT_MODULATION: Final = 0.75
"""The same of step and force drop per event, of their means; that it depends on the contact little was measured."""
PEAK_MODULATION: Final = 1.2
"""The same of the force at which a pin first slides, between starts."""
DISORDER: Final = 0.5
"""Standard deviation of the mean force between seeds, of its mean, times √nodes over the spread of μ_i."""
LEFT_OVER: Final = 1.1
"""What of the standard error of blocks is left of a mean over one whole spacing, of whose blocks the most is modulation."""
EVENLY: Final = 0.6
"""What of the standard error of independent members is left where their starts are spread evenly."""
EVENT_LEFT_OVER: Final = 0.1
"""Uncertainty of step and drop per event over one whole spacing, of their means."""


@dataclass(frozen=True, slots=True)
class Sampling:
    """A stretch of a record: its length in node spacings, nodes in contact on average, and the case's slip rule and disorder."""

    spacings: float
    nodes: float
    residual: float = 0.0
    spread: float = 0.0

    @property
    def unseen(self) -> float:
        """Share of a modulation over one node spacing that a mean over the stretch has in it: |sin πs|/πs, 0 from s = 1 on."""
        return float(abs(np.sinc(self.spacings))) if self.spacings < 1.0 else 0.0

    @property
    def discreteness(self) -> float:
        """What one node's slip drops, as a share of the load's friction."""
        return (1.0 - self.residual) / max(self.nodes, 1.0)

    @property
    def disorder(self) -> float:
        """Relative standard error of a mean force because other nodes would have had other μ_i."""
        nodes = max(self.nodes, 1.0)
        return DISORDER * self.spread / math.sqrt(nodes + self.spacings)

    def of_mean_force(self, blocks: NDArray[np.float64], within: float) -> float:
        """Standard error of the mean force over the stretch, from its block means (b,) and their own standard error `within`."""
        mean = abs(float(blocks.mean()))
        seen = float(np.std(blocks, ddof=1))
        if self.spacings >= 1.0:
            sampled = LEFT_OVER * seen / math.sqrt(len(blocks)) / math.floor(self.spacings)
        else:
            # What was seen of the modulation tells its size the better the more of a spacing it was.
            expected = MODULATION * self.discreteness * mean
            modulation = math.hypot(math.sqrt(1.0 - self.spacings) * expected, math.sqrt(self.spacings) * seen)
            sampled = math.hypot(within, self.unseen * modulation)
        return math.hypot(sampled, self.disorder * mean)

    def of_events(self) -> float:
        """Relative standard error of step and drop per event over the stretch; of disorder alone where slips drop nothing."""
        if self.residual == 1.0:
            return self.disorder
        if self.spacings >= 1.0:
            return math.hypot(EVENT_LEFT_OVER / self.spacings, self.disorder)
        return math.hypot(self.unseen * EVENT_MODULATION, EVENT_LEFT_OVER, self.disorder)

    def of_peak(self) -> float:
        """Relative standard deviation, between starts, of the force at which a pin first slides."""
        return math.hypot(PEAK_MODULATION * self.discreteness, DISORDER * self.spread / math.sqrt(max(self.nodes, 1.0)))


def ensemble_uncertainty(values: NDArray[np.float64]) -> float:
    """Standard error of the mean over members (m,) whose starts are spread evenly over a node spacing; NaN of fewer than 2.

    Members without a value (NaN) are left out; then phases are missing, and all of the scatter counts as chance.
    """
    found = values[np.isfinite(values)]
    if len(found) < 2:
        return math.nan
    even = EVENLY if len(found) == len(values) else 1.0
    return even * float(np.std(found, ddof=1)) / math.sqrt(len(found))
