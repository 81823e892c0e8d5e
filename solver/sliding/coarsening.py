"""A case on a grid that is coarser, to measure what the node spacing decides."""

from dataclasses import replace

from nanoslip.solver.case import Case
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.sliding.validity import predict_flags


def double_spacing(case: Case) -> Case | None:
    """The case on nodes about twice as far apart; None if its scheme or settings exclude that, or if the coarser grid has a
    validity flag that the case itself has not: its numbers would not measure the influence of the spacing."""
    nodes = 2 * round((case.slab.n_x - 1) / 4) + 1  # all schemes take odd numbers alone
    scheme = case.slab.scheme
    # Settings that nobody gave follow from the number of nodes.
    usual = replace(case.slab, scheme=scheme.name)
    try:
        settings = scheme.name if usual == case.slab else scheme
        coarse = replace(case, slab=replace(case.slab, n_x=nodes, scheme=settings))
    except InvalidInput:
        return None
    return None if {*predict_flags(coarse)} - {*predict_flags(case)} else coarse
