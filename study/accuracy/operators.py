"""Error against time of the surface compliance of a slab: scheme × n_x × grading.

The reference of an elastic operator is the finest affordable compliance: the Galerkin scheme on a much finer and evenly graded
grid. It is nanoslip's own; tests/verification show that it converges to the slab of an independent library.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import fields, replace
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from nanoslip.solver.arrays import Vector
from nanoslip.solver.case import Case
from nanoslip.solver.contact.closed_forms import smooth_contact
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.elasticity.compliance import Compliance, EndlessCompliance, surface_compliance
from nanoslip.solver.elasticity.schemes.endless import EndlessScheme
from nanoslip.solver.outcome import InvalidInput, SolverError
from nanoslip.solver.parameter import field_choices
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.solver.sliding.slide import slide
from nanoslip.study.accuracy.diagram import Diagram, Row
from nanoslip.study.accuracy.effects import measure_time
from nanoslip.study.accuracy.setup import Effort, Setup, change_discretization, contacts, discretization_settings
from nanoslip.study.manifest.parameters import Value

DISPLACEMENT: Final = 3e-4
"""Displacement of the record whose time counts as the cost of using an operator, in L_x."""
OF_OPERATORS: Final = ("normal_compliance", "tangential_compliance", "stiffness", "approach", "half_width", "pressure")
"""Quantities whose largest error is the error of an operator: energies of an elliptic pressure and of an elliptic shear,
lateral stiffness K of the stuck contact, and approach, half-width (from the second moment) and largest pressure of
frictionless contact."""
COUPLING: Final = "coupling"
GRADINGS: Final[tuple[dict[str, int], ...]] = (
    *({"coarsest_row": rows} for rows in (5, 9, 33, 65)),
    *({"rows_per_level": rows} for rows in (1, 4)),
    {"rows_per_level": 4, "coarsest_row": 33},
)
"""Gradings of the Galerkin scheme that are tried besides the default."""
REFERENCE: Final[dict[str, Any]] = {"scheme": "galerkin", "coarsest_row": 129, "rows_per_level": 4}
"""Discretization of the reference; its n_x is the effort's."""


def discretizations(slab: Slab, size: int) -> Iterator[Slab]:
    """Discretize a body at one n_x: a surface without ends in its one way, a slab by every grid scheme and grading."""
    if slab.scheme.endless:
        yield replace(slab, n_x=size)
        return
    names = [name for name, kind in SCHEMES.items() if kind.continuum and not kind.endless]
    ways: list[dict[str, Any]] = [{"scheme": "galerkin", **grading} for grading in GRADINGS]
    for way in [*({"scheme": name} for name in names), *ways]:
        # Rows finer than the surface are refused.
        with suppress(InvalidInput):
            yield change_discretization(slab, {"n_x": size, **way})


def reference_slab(slab: Slab, size: int) -> Slab:
    """Discretize the same body as finely as possible, its rows no coarser than the surface allows."""
    if slab.scheme.endless:
        return replace(slab, n_x=size)
    coarsest = min(size, REFERENCE["coarsest_row"])
    return change_discretization(slab, {"n_x": size, **REFERENCE, "coarsest_row": coarsest})


def measure_elastic_operator(setup: Setup, effort: Effort) -> Diagram:
    """Errors and times of every discretization; errors are the largest of contacts about as wide as the setup's own."""
    slab = setup.case.slab
    truth, doubt = _reference(slab, effort, contacts(setup.case, effort))
    # Different words may mean the same grid.
    by_size = (discretizations(slab, size) for size in effort.sizes)
    grids = dict.fromkeys(itertools.chain.from_iterable(by_size))
    by_grid = (_measure_discretization(setup, grid, effort, truth) for grid in grids)
    rows = tuple(itertools.chain.from_iterable(by_grid))
    fine = reference_slab(slab, effort.reference_size)
    settings, seconds = ("n_x", "scheme", "rows_per_level", "coarsest_row"), ("seconds", "record_seconds")
    shown = (*settings, *seconds, "error", *OF_OPERATORS, COUPLING)
    return Diagram("Elastic operator", _words(fine, doubt), "scheme", shown, "error", rivals=True, rows=rows)


def _reference(slab: Slab, effort: Effort, widths: tuple[float, ...]) -> tuple[dict[float, dict[str, float]], float]:
    """Half-width of the contact -> the finest observables, and their largest change on a surface half as fine."""
    sizes = (effort.reference_size, (effort.reference_size + 1) // 2)
    compliances = (surface_compliance(reference_slab(slab, size)) for size in sizes)
    fine, coarse = (punch_observables(compliance, widths) for compliance in compliances)
    # The change from twice the spacing bounds the error that is left: errors fall at least in proportion to the spacing.
    changes = [relative_errors(coarse[width], fine[width]) for width in widths]
    return fine, max(map(_worst, changes))


def relative_errors(values: Mapping[str, float], truth: Mapping[str, float]) -> dict[str, float]:
    """Observable -> |value/truth - 1|."""
    ratios = {name: values[name] / truth[name] for name in values}
    return {name: abs(ratio - 1.0) for name, ratio in ratios.items()}


def punch_observables(compliance: Compliance, half_widths: Iterable[float]) -> dict[float, dict[str, float]]:
    """Half-width of the contact -> observable -> value, dimensionless, at a load of 1e-3 G·L_x·L_y."""
    observables = {}
    for width in half_widths:
        observables[width] = {**_energies(compliance, width), **_contact(compliance, width)}
    return observables


def _energies(compliance: Compliance, half_width: float) -> dict[str, float]:
    """Energies of unit elliptic loads, and the work of an odd shear on the sideways displacement by an elliptic
    pressure."""
    even = _elliptic_forces(compliance, half_width)
    # An even pressure moves the surface sideways by an odd amount, on which an even shear would do no work.
    odd = even * compliance.x / half_width
    nothing = np.zeros(len(even))
    sideways, down = compliance.displacements(np.array([nothing, even]))
    dragged, _ = compliance.displacements(np.array([even, nothing]))
    # Work of a load on its own displacement: ½ fᵀ C f.
    return {
        "normal_compliance": 0.5 * float(even @ down),
        "tangential_compliance": 0.5 * float(even @ dragged),
        COUPLING: float(odd @ sideways),
    }


def _elliptic_forces(compliance: Compliance, half_width: float) -> Vector:
    """Nodal forces (n,) of a unit elliptic load: of a cylinder, or on a plane of nodes of a ball."""
    if "y" in compliance.slab.layout.AXES:
        return nodal_forces_of_ball(compliance, half_width)
    return nodal_forces(compliance.x, half_width)


GAUSS: Final = np.polynomial.legendre.leggauss(16)
"""Places and weights in [-1, 1] across a column of squares, where the rest is in closed form."""


def nodal_forces_of_ball(compliance: Compliance, radius: float) -> Vector:
    """Nodal forces (n,) of a unit load q = 3/(2πa²)·√(1 - (r/a)²): the load on each node's square.

    Across a column at x, with c² = a² - x²: ∫√(c² - y²) dy = ½ (y √(c² - y²) + c² asin(y/c)).
    """
    places, weights = GAUSS
    middles = np.unique(compliance.x)
    half = 0.5 * (middles[1] - middles[0])
    # A column that the edge cuts bears load up to the edge alone.
    low = np.clip(middles - half, -radius, radius)
    high = np.clip(middles + half, -radius, radius)
    half_width = 0.5 * (high - low)
    middle = 0.5 * (low + high)
    x = middle[:, None] + half_width[:, None] * places
    # Rounding may put a place of the outermost column beyond the edge.
    square = np.maximum(radius**2 - x**2, 0.0)
    chord = np.sqrt(square)[..., None]
    edges = np.append(middles - half, middles[-1] + half)
    y = np.clip(edges, -chord, chord)
    sine = np.zeros_like(y)
    np.divide(y, chord, out=sine, where=chord > 0.0)
    root = np.sqrt(np.maximum(chord**2 - y**2, 0.0))
    # The integral up to each edge; the load of a square is the difference between its edges.
    up_to_edge = 0.5 * (y * root + chord**2 * np.arcsin(sine))
    across = np.diff(up_to_edge, axis=-1)
    # Columns c, places of Gauss g, rows r: the sum over places is the integral along x.
    columns = np.einsum("cgr,g,c->cr", across, weights, half_width)
    # The load's 3/(2πa²), and 1/a of its root.
    scale = 1.5 / (np.pi * radius**3)
    return np.asarray(scale * columns.ravel())


def nodal_forces(x: Vector, half_width: float) -> Vector:
    """Nodal forces (n,) of a unit load q = 2/(πa)·√(1 - (x/a)²): the load on each node's width of surface, with its
    moment.

    Linear between nodes: f_i = ∫ q·hat_i dx, so that the sum is 1 whatever the spacing.
    """
    s = np.clip(x / half_width, -1.0, 1.0)
    root = np.sqrt(1.0 - s**2)
    # Twice the integral of q: ∫∫q = x·(½ + (s√(1-s²) + asin s)/π) - ∫x q dx.
    share = 0.5 + (s * root + np.arcsin(s)) / np.pi
    # ∫x q dx from the left end.
    moment = -2.0 * half_width / (3.0 * np.pi) * root**3
    second = x * share - moment
    # By parts: ∫ q·hat_i is the second difference of ∫∫q over the spacing. Beyond both ends its slope is ∫q, the share.
    slope = np.diff(second) / np.diff(x)
    return np.diff(slope, prepend=share[0], append=share[-1])


def _contact(compliance: Compliance, half_width: float) -> dict[str, float]:
    """Frictionless contact of a parabola, and the lateral stiffness of its stuck nodes."""
    slab, normal_load = compliance.slab, 1e-3
    # Hertz's half-width depends on the product of load and radius: that which goes with one is found as the other.
    closed_form = smooth_contact(slab.scheme.LAYOUT)
    radius = closed_form.hertz_load(half_width, normal_load, slab.poisson)
    case = Case(radius=radius, normal_load=normal_load, slab=slab, initial_contact="frictionless")
    state = initial_contact(case, compliance)
    if not state.outcome.ok:
        return dict.fromkeys(("stiffness", "approach", "half_width", "pressure"), math.nan)
    normal = -state.nodal_force[1] / normal_load
    # The second moment of an elliptic pressure along x is a²/4 of a cylinder, a²/5 of a ball.
    ellipse = 3.0 + len(slab.layout.AXES)
    return {
        "stiffness": lateral_stiffness(compliance, np.flatnonzero(state.contact)),
        "approach": state.approach,
        "half_width": math.sqrt(ellipse * float(normal @ compliance.x**2)),
        "pressure": float(state.pressure.max()) / normal_load,
    }


def lateral_stiffness(compliance: Compliance, nodes: NDArray[np.int64]) -> float:
    """K = dF/dδ_p of nodes that all stick, the load constant and the approach free (Eq. 15), in G·L_y."""
    m = len(nodes)
    # Tangential displacements come first, normal ones behind them.
    rows = np.concatenate((nodes, nodes + compliance.slab.nodes))
    # The load is held by a last row, the sum of all normal forces, whose unknown is the approach.
    pressed = np.repeat((0.0, 1.0), m)[:, None]
    entries = compliance.entries(rows, rows)
    corner = np.zeros((1, 1))
    bordered = np.block([[entries, pressed], [pressed.T, corner]])
    # All nodes move by one along the surface; the normal load changes by nothing.
    moved = np.zeros(2 * m + 1)
    moved[:m] = 1.0
    forces = np.linalg.solve(bordered, moved)
    return float(forces[:m].sum())


def _measure_discretization(
    setup: Setup, slab: Slab, effort: Effort, truth: Mapping[float, Mapping[str, float]]
) -> Iterator[Row]:
    """Times and errors of a discretization, or nothing where the slab or its contact has no answer in it."""
    case = replace(setup.case, slab=slab, max_events=None, max_displacement=DISPLACEMENT)
    try:
        compliance, seconds = measure_time(partial(_compute_anew, slab), effort.repeats)
    except SolverError:
        return
    values = punch_observables(compliance, truth)
    _, record_seconds = measure_time(partial(slide, case, compliance), effort.repeats)
    errors = [relative_errors(values[width], truth[width]) for width in truth]
    if not any(math.isnan(value) for numbers in errors for value in numbers.values()):
        worst = {name: max(numbers[name] for numbers in errors) for name in errors[0]}
        times = {"seconds": seconds, "record_seconds": record_seconds}
        yield {**_knobs(slab), **times, **worst, "error": _worst(worst)}


def _compute_anew(slab: Slab) -> Compliance:
    """The surface compliance, without the convolutions that `surface_compliance` keeps and finds in no time."""
    if isinstance(slab.scheme, EndlessScheme):
        return EndlessCompliance(slab.scheme.convolution(slab), slab)
    return surface_compliance(slab)


def _worst(errors: Mapping[str, float]) -> float:
    """The largest error, the coupling's left out."""
    return max(errors[name] for name in OF_OPERATORS)


def _words(slab: Slab, doubt: float) -> str:
    """The reference and its doubt."""
    settings = discretization_settings(slab).items()
    grid = ", ".join(f"{name} = {value}" for name, value in settings if value is not None)
    return f"{grid}; with half as many nodes on its surface it changes by {100.0 * doubt:.2g} %"


def _knobs(slab: Slab) -> dict[str, Value]:
    """Settings that discretize a slab; numbers that its scheme does not have are NaN, words empty."""
    kinds: tuple[Any, ...] = tuple(SCHEMES.values())
    words = {item.name for kind in kinds for item in fields(kind) if field_choices(item.type)}
    knobs = discretization_settings(slab)
    for name, value in knobs.items():
        if value is None:
            knobs[name] = "" if name in words else math.nan
    return knobs
