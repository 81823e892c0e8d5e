"""The elastic slab and its discretization: all that a surface compliance depends on.

A scheme is one file of `nanoslip.solver.elasticity.schemes`: a frozen type with its settings as fields, registered by its name.
Other names are refused.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, ClassVar, Literal, Self

from nanoslip.solver.arrays import Floats
from nanoslip.solver.layout import Layout, Row
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
    length: ClassVar[float] = 1.0
    """Length of the surface, in L_x; infinite if it goes on beyond its end nodes."""
    endless: ClassVar[bool] = False
    """True if the surface continues beyond its end nodes: no sides."""
    has_height: ClassVar[bool] = True
    """False if no number depends on the slab's height."""
    bottomless: ClassVar[bool] = False
    """True if the body has no bottom: a contact is as wide as on a half-plane."""
    incompressible: ClassVar[bool] = False
    """True if it accepts ν = 0.5."""
    LAYOUT: ClassVar[type[Layout]] = Row
    """Layout of the surface nodes: a row or a plane."""
    end_share: ClassVar[float] = 0.5
    """Surface of the end nodes over that of others: half a control volume, unless the surface goes on or blocks are all alike."""
    IN_PLANE_STRAIN: ClassVar[str] = ""
    """Name of the scheme for the same body in plane strain; empty where this one is in plane strain."""
    continuum: ClassVar[bool] = True
    """True if it is an elastic body that G and ν describe completely."""
    sizes: ClassVar[str] = f"2^N + 1 with N from 2 to {MOST_LEVELS}: 5, 9, 17, 33, 65, 129 … {MOST_NODES}"
    """Accepted values of n_x, in words."""

    @classmethod
    def takes(cls, n_x: int) -> bool:
        """True if it accepts this number of surface nodes."""
        return 2 <= grid_levels(n_x) <= MOST_LEVELS

    def count_stored_numbers(self, slab: "Slab") -> int:
        """Number of entries of a surface compliance that is kept for others; 0 if it is computed faster than read."""
        return (2 * slab.n_x) ** 2

    def complete_settings(self, slab: "Slab") -> Self:
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

    @abstractmethod
    def lateral_stiffness(self, slab: "Slab", nodes: float) -> float:
        """An estimate of the stiffness K, in G·L_y, of a contact with this number of nodes across that move together."""

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
            settings = SCHEMES.find_member(settings)()
        require("n_x", self.n_x, settings.takes(self.n_x), settings.sizes)
        is_allowed = settings.incompressible or self.poisson < 0.5
        require("poisson", self.poisson, is_allowed, "less than 0.5 with a grid; others take 0.5")
        # Settings may depend on the spacing, and so on the layout of their own scheme.
        object.__setattr__(self, "scheme", settings)
        object.__setattr__(self, "scheme", settings.complete_settings(self))

    @classmethod
    def of(cls, parameters: Mapping[str, Any]) -> Self:
        """Build the slab from parameters by name, the scheme's included. Raises InvalidInput, for unknown names
        too."""
        refuse_unknown(parameters, parameters_of_a_slab(), "a slab")
        numbers = {name: parameters[name] for name in declared(cls) if name in parameters}
        return cls(**{**numbers, "scheme": SCHEMES.member(parameters, "galerkin")})

    @property
    def flat(self) -> dict[str, Any]:
        """Every parameter of the slab, its scheme by name and that one's settings beside it; None for other schemes'."""
        numbers = {name: getattr(self, name) for name in declared(type(self))}
        return numbers | SCHEMES.flat(self.scheme)

    @property
    def layout(self) -> Layout:
        """Layout of the surface nodes."""
        return _make_layout(self.scheme.LAYOUT, self.n_x, self.scheme.end_share)

    @property
    def rows(self) -> int:
        """Number of surface nodes across the drag: 1 in plane strain."""
        return self.layout.rows

    @property
    def nodes(self) -> int:
        """Number of surface nodes."""
        return self.layout.nodes

    @property
    def spacing(self) -> float:
        """Distance between surface nodes, in L_x."""
        return self.layout.spacing

    @property
    def node_area(self) -> float:
        """Surface that belongs to a node inside of the surface, in L_x; of a plane of nodes in L_x²."""
        return self.layout.node_area


# Kept: estimates of a case ask some thirty times, which was a tenth of the time of planning it.
@lru_cache(maxsize=256)
def _make_layout(kind: type[Layout], n_x: int, end_share: float) -> Layout:
    return kind(n_x, end_share)


def parameters_of_a_slab() -> Mapping[str, Parameter]:
    """Every parameter of a slab by name, including the parameters of all schemes."""
    return merge_parameters(Slab, *SCHEMES.values())


PHYSICS = ("aspect_ratio", "poisson", "support")
"""Fields of a slab that are physical; all others, its scheme's too, set its discretization."""


LIMITED_BY_SCHEME = ("n_x", "poisson")
"""Fields of a slab whose allowed values depend on its scheme."""


def grid_levels(nodes: int | None) -> int:
    """q of a row of 2^q + 1 nodes; 0 if `nodes` is None or of another form."""
    intervals = (nodes or 0) - 1
    # Of numbers above 0, n & (n - 1) is 0 for powers of two alone.
    return intervals.bit_length() - 1 if intervals > 0 and intervals & (intervals - 1) == 0 else 0
