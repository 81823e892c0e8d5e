"""The elastic slab and its discretization: all that a surface compliance depends on.

A scheme is one file of `nanoslip.solver.elasticity.schemes`: a frozen type with its settings as fields, registered by its name.
Other names are refused.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, Literal, Self

import numpy as np

from nanoslip.solver.arrays import Floats
from nanoslip.solver.parameter import (
    Family,
    Parameter,
    declared,
    merge_parameters,
    parameter,
    refuse_unknown,
    require,
    validate,
)

Support = Literal["bonded", "frictionless", "right_side"]

MOST_LEVELS = 20
"""N of the finest surface, 2^N + 1 nodes: its compliance alone would take 35 TB."""
FEWEST_NODES, MOST_NODES = 2**2 + 1, 2**MOST_LEVELS + 1


class Scheme(ABC):
    """A discretization of the slab: a frozen dataclass of its settings, and the surface compliance that they lead to."""

    TABLE: ClassVar[str] = "numerics"
    name: ClassVar[str]
    reciprocal: ClassVar[bool] = True
    """True if its operator is that of an elastic body: symmetric, positive definite."""
    endless: ClassVar[bool] = False
    """True if the surface continues beyond its end nodes: no sides."""
    bottomless: ClassVar[bool] = False
    """True if the body has no bottom: a contact is as wide as on a half-plane."""
    incompressible: ClassVar[bool] = False
    """True if it accepts ν = 0.5."""
    equal_widths: ClassVar[bool] = False
    """True if the end nodes have as much surface as all others."""
    planar: ClassVar[bool] = False
    """True if its surface is a square of n_x by n_x nodes, numbered column by column along x; else it is a row."""
    continuum: ClassVar[bool] = True
    """True if it is an elastic body that G and ν describe completely."""
    sizes: ClassVar[str] = f"2^N + 1 with N from 2 to {MOST_LEVELS}: 5, 9, 17, 33, 65, 129 … {MOST_NODES}"
    """Accepted values of n_x, in words."""

    @classmethod
    def takes(cls, n_x: int) -> bool:
        """True if it accepts this number of surface nodes."""
        return 2 <= grid_levels(n_x) <= MOST_LEVELS

    def completed(self, slab: "Slab") -> Self:
        """These settings with the scheme's own values in place of None. Raises InvalidInput for what does not fit the slab."""
        if self.bottomless:
            require("support", slab.support, slab.support == "bonded", 'scheme = "galerkin" or "biquadratic"')
        return self

    @abstractmethod
    def matrix(self, slab: "Slab") -> Floats:
        """The surface compliance, (2n, 2n), in 1/G per unit depth. Raises SingularOperator or InvalidInput."""

    def resolves(self, slab: "Slab", half_width: float) -> bool:
        """True if its nodes deform under a contact of this half-width (in L_x) as the slab's surface does."""
        return True

    @property
    def bed_stiffness(self) -> float | None:
        """Stiffness per length of independent springs under the surface, in G/L_x; None for a continuum."""
        return None

    def is_laterally_restrained(self, slab: "Slab") -> bool:
        """True if a boundary keeps the slab from following the drag for ever."""
        return True

    def __str__(self) -> str:
        return self.name


SCHEMES: Family[Scheme] = Family("scheme")
"""Every scheme there is."""


@dataclass(frozen=True, slots=True)
class Slab:
    """The elastic slab and its discretization.

    scheme: settings of a scheme, or a scheme's name, which gives it default settings. Raises InvalidInput for values
        out of range.
    """

    TABLE: ClassVar[str] = "numerics"
    n_x: int = parameter(
        129,
        meaning="surface nodes",
        comment="their spacing L_x/(n_x - 1) is the size of the elements that slip",
        need="2^N + 1 with N from 2 to 20; on a surface without ends: odd",
    )
    aspect_ratio: float = parameter(
        1.0,
        table="constants",
        meaning="height of the slab over its width",
        symbol="L_z/L_x",
        least=1e-4,
        most=1e4,
        scale="slab_width",
    )
    poisson: float = parameter(
        1.0 / 3.0, table="constants", meaning="Poisson's ratio", symbol="ν", above=-1.0, most=0.5
    )
    support: Support = parameter(
        "bonded", meaning="how the slab is held", comment="at its base, without friction there, or at its right side"
    )
    scheme: Any = parameter("galerkin", meaning="discretization of the slab")

    def __post_init__(self) -> None:
        validate(self)
        settings: Any = self.scheme
        if not isinstance(settings, Scheme):
            settings = SCHEMES.named(settings)()
        require("n_x", self.n_x, settings.takes(self.n_x), settings.sizes)
        taken = settings.incompressible or self.poisson < 0.5
        require("poisson", self.poisson, taken, "less than 0.5 with a grid; others take 0.5")
        object.__setattr__(self, "scheme", settings.completed(self))

    @classmethod
    def of(cls, parameters: Mapping[str, Any]) -> Self:
        """Build the slab from parameters by name, the scheme's included. Raises InvalidInput, for unknown names
        too."""
        refuse_unknown(parameters, parameters_of_a_slab(), "a slab")
        own = {name: parameters[name] for name in declared(cls) if name in parameters}
        return cls(**{**own, "scheme": SCHEMES.member(parameters, "galerkin")})

    @property
    def flat(self) -> dict[str, Any]:
        """Every parameter of the slab, its scheme by name and that one's settings beside it; None for other schemes'."""
        own = {name: getattr(self, name) for name in declared(type(self))}
        return own | SCHEMES.flat(self.scheme)

    @property
    def rows(self) -> int:
        """Number of surface nodes across the drag: 1 in plane strain."""
        return self.n_x if self.scheme.planar else 1

    @property
    def nodes(self) -> int:
        """Number of surface nodes."""
        return self.n_x * self.rows

    @property
    def spacing(self) -> float:
        """Distance between surface nodes, in L_x."""
        return 1.0 / (self.n_x - 1)

    @property
    def node_area(self) -> float:
        """Surface that belongs to a node inside of the surface, in L_x; of a plane of nodes in L_x²."""
        return self.spacing**2 if self.scheme.planar else self.spacing


def parameters_of_a_slab() -> Mapping[str, Parameter]:
    """Every parameter of a slab by name, including the parameters of all schemes."""
    return merge_parameters(Slab, *SCHEMES.values())


@lru_cache(maxsize=4)  # asked many times for each case, and few campaigns have more grids at a time
def surface_x(n_x: int, first_node: int = 0, nodes: int | None = None) -> Floats:
    """Positions of a slab's n_x surface nodes from its middle, in L_x, (n_x,), read-only.

    On a surface without ends a window of nodes may begin anywhere.
    """
    places = np.linspace(-0.5, 0.5, n_x)
    if first_node or nodes not in (None, n_x):
        places = (np.arange(nodes or n_x) + first_node) / (n_x - 1) - 0.5
    places.setflags(write=False)
    return places


def surface_y(rows: int, nodes: int) -> Floats:
    """Positions across the drag of this number of surface nodes in rows, from the middle row, in L_x; 0 of a single row."""
    return np.tile(surface_x(rows) if rows > 1 else np.zeros(1), nodes // rows)


PHYSICS = ("aspect_ratio", "poisson", "support")
"""Fields of a slab that are physical; all others, its scheme's too, set its discretization."""


LIMITED_BY_SCHEME = ("n_x", "poisson")
"""Fields of a slab whose allowed values depend on its scheme."""


def grid_levels(nodes: int | None) -> int:
    """q of a row of 2^q + 1 nodes; 0 if `nodes` is None or of another form."""
    intervals = (nodes or 0) - 1
    return intervals.bit_length() - 1 if intervals > 0 and intervals & (intervals - 1) == 0 else 0
