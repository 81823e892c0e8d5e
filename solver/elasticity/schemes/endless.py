"""Schemes of a surface that continues beyond its end nodes and is the same everywhere: their compliance is a convolution."""

from abc import abstractmethod

from solver.elasticity.schemes.convolution import Convolution
from solver.outcome import InvalidInput
from solver.slab import FEWEST_NODES, MOST_NODES, SCHEMES, Scheme, Slab


class EndlessScheme(Scheme):
    """A scheme without sides and bottom, hence without rows of nodes to be halved: its surface takes any odd n_x."""

    endless = True
    equal_widths = True
    sizes = f"an odd number from {FEWEST_NODES} to {MOST_NODES}"

    @classmethod
    def takes(cls, n_x: int) -> bool:
        return FEWEST_NODES <= n_x <= MOST_NODES and n_x % 2 == 1

    @abstractmethod
    def convolution(self, slab: Slab) -> Convolution:
        """Displacements under normal forces, those of `matrix`. Raises InvalidInput."""


def convolution_of(slab: Slab) -> Convolution:
    """The slab's compliance under normal forces. Raises InvalidInput where its surface has ends."""
    if isinstance(slab.scheme, EndlessScheme):
        return slab.scheme.convolution(slab)
    having = ", ".join(name for name, kind in SCHEMES.items() if issubclass(kind, EndlessScheme))
    raise InvalidInput(f"scheme = {slab.scheme.name!r}: needs one whose surface has no ends: {having}")
