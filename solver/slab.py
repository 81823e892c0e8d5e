"""The elastic slab and its discretization: all that a surface compliance depends on.

A scheme is one file of `solver.elasticity.schemes`: a frozen type with its settings as fields, registered by its name. What is
not registered is refused by name.
"""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar, Literal, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from solver.outcome import InvalidInput, quoted
from solver.parameter import check, declared, parameter, require, settings_of

Support = Literal["bonded", "frictionless", "right_side"]

MOST_LEVELS = 20
"""N of the finest surface, 2^N + 1 nodes: its compliance alone would take 35 TB."""


class Scheme(ABC):
    """A discretization of the slab: a frozen dataclass of its settings, and the surface compliance that they lead to."""

    name: ClassVar[str]
    reciprocal: ClassVar[bool] = True
    """Whether its operator is an elastic body's: symmetric, positive definite."""
    endless: ClassVar[bool] = False
    """Whether the surface goes on beyond its end nodes: no sides, no bottom."""

    @abstractmethod
    def completed(self, slab: "Slab") -> Self:
        """These settings with the scheme's own values in place of None. Raises InvalidInput for what does not fit the slab."""

    @abstractmethod
    def matrix(self, slab: "Slab") -> NDArray[np.float64]:
        """The surface compliance, (2n, 2n), in 1/G per unit depth. Raises SingularOperator or InvalidInput."""

    def __str__(self) -> str:
        return self.name


SCHEMES: dict[str, type[Scheme]] = {}
"""Name -> settings type of every scheme."""
_Kind = TypeVar("_Kind", bound=type[Scheme])


def scheme(kind: _Kind) -> _Kind:
    """Register a scheme under its name: from then on slabs, manifests and documentation know it."""
    SCHEMES[kind.name] = kind
    return kind


@dataclass(frozen=True, slots=True)
class Slab:
    """The elastic slab and its discretization.

    scheme: settings of one of the schemes, or the name of one, with its own values. Raises InvalidInput for values out of range.
    """

    n_x: int = parameter(129, table="numerics", meaning="surface nodes", need="2^N + 1 with N from 2 to 20")
    aspect_ratio: float = parameter(
        1.0, table="constants", meaning="height of the slab over its width, L_z/L_x", least=1e-4, most=1e4
    )
    poisson: float = parameter(1.0 / 3.0, table="constants", meaning="Poisson's ratio ν", above=-1.0, below=0.5)
    support: Support = parameter("bonded", table="numerics", meaning="how the slab is held")
    scheme: Any = parameter("galerkin", table="numerics", meaning="discretization of the slab")

    def __post_init__(self) -> None:
        check(self)
        levels = levels_of(self.n_x)
        nodes = f"2^N + 1 with N from 2 to {MOST_LEVELS}: 5, 9, 17, 33, 65, 129 … {2**MOST_LEVELS + 1}"
        require("n_x", self.n_x, 2 <= levels <= MOST_LEVELS, nodes)
        settings: Any = self.scheme
        if not isinstance(settings, Scheme):
            settings = scheme_named(settings)()
        object.__setattr__(self, "scheme", settings.completed(self))

    @classmethod
    def of(cls, parameters: Mapping[str, Any]) -> Self:
        """The slab with these parameters, those of its scheme beside its own. Raises InvalidInput."""
        chosen = parameters.get("scheme", "galerkin")
        if isinstance(chosen, Scheme):
            parameters = {**parameters, **{name: getattr(chosen, name) for name in declared(type(chosen))}}
            chosen = chosen.name
        kind = scheme_named(chosen)
        given = {name: parameters[name] for name in scheme_settings() if parameters.get(name) is not None}
        for name, value in given.items():
            owners = scheme_settings()[name]
            require(name, value, kind in owners, "scheme = " + " or ".join(f'"{owner.name}"' for owner in owners))
        own = {name: parameters[name] for name in declared(cls) if name in parameters}
        return cls(**{**own, "scheme": kind(**given)})

    @property
    def flat(self) -> dict[str, Any]:
        """Every parameter of the slab, its scheme by name and that one's settings beside it; None for other schemes'."""
        own = {name: getattr(self, name) for name in declared(type(self))}
        return {**own, "scheme": self.scheme.name} | {
            name: getattr(self.scheme, name, None) for name in scheme_settings()
        }

    @property
    def spacing(self) -> float:
        """Distance between surface nodes, in L_x."""
        return 1.0 / (self.n_x - 1)


PHYSICS = ("aspect_ratio", "poisson", "support")
"""Fields of a slab that say what it is; all others, its scheme's too, say how it is discretized."""


def scheme_settings() -> Mapping[str, tuple[type[Scheme], ...]]:
    """Setting of a scheme -> the schemes that have it."""
    return settings_of(*SCHEMES.values())


def levels_of(nodes: int | None) -> int:
    """q of a row of 2^q + 1 nodes; 0 where there is none."""
    intervals = (nodes or 0) - 1
    return intervals.bit_length() - 1 if intervals > 0 and intervals & (intervals - 1) == 0 else 0


def scheme_named(name: object) -> type[Scheme]:
    """The settings type of a scheme. Raises InvalidInput for an unknown name."""
    if isinstance(name, str) and name in SCHEMES:
        return SCHEMES[name]
    raise InvalidInput(f"scheme = {quoted(name)}: needs one of " + ", ".join(SCHEMES))
