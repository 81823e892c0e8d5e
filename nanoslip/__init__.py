"""A friction laboratory: a rigid curved pin on an elastic slab, and the static and kinetic friction of their nanoscale slip.

One case, from its contact to the friction that a stage measures; all numbers are dimensionless (see `Case` and `Scales`):

>>> import nanoslip
>>> case = nanoslip.Case(intrinsic_friction=0.5, radius=50.0, slab=nanoslip.Slab(n_x=17), max_events=200)
>>> record = nanoslip.friction_record(case)
>>> record.outcome.ok, 0.2 < nanoslip.plateau_of(record).mean < 0.4
(True, True)

A campaign, that is many cases, from a file or a dict to one labelled dataset:

>>> data = nanoslip.run({
...     "title": "Plateau for two loads",
...     "axes": {"normal_load": [1e-3, 2e-3]},
...     "numerics": {"n_x": 17},
...     "limits": {"events": 200},
... })
>>> data.plateau_mean.squeeze().dims
('normal_load',)
>>> print(nanoslip.describe("plateau_mean").comment)
mean friction force over load on the steady part of the record, over displacement
>>> data.nanoslip.record(normal_load=1e-3).displacement.dims
('event',)

`run`, `open`, `concat`, `figure` and `describe` are of campaigns and datasets, whose accessor `.nanoslip` finds records,
trajectories and contacts; everything else is of single cases. Results are one line in a console; `.plot()` draws them,
`.to_xarray()` labels their numbers, and `frames` shows a case at work. A name is imported when it is first used. The command
`nanoslip --help` does the same from a shell.
"""

import ast
import importlib
import os
import signal
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from nanoslip.solver.case import Case, Effects, Heterogeneity, Interface, SlipRule
    from nanoslip.solver.contact.closed_forms import (
        cattaneo_mindlin,
        flat_punch_pressure,
        hertz,
        sliding_parabola,
        sliding_punch,
    )
    from nanoslip.solver.contact.state import ContactState, mirrored
    from nanoslip.solver.drive import Drive, Scales
    from nanoslip.solver.dynamics.coefficients import FrictionCoefficients
    from nanoslip.solver.dynamics.friction_limit import NoPlateauError
    from nanoslip.solver.dynamics.integrators import RK4, Exact
    from nanoslip.solver.dynamics.result import DynamicsResult
    from nanoslip.solver.dynamics.stick_slip import Oscillator, stick_slip
    from nanoslip.solver.elasticity.compliance import SurfaceCompliance, surface_compliance
    from nanoslip.solver.elasticity.schemes import Biquadratic, Chain, Galerkin, HalfPlane
    from nanoslip.solver.outcome import Ending, InvalidInput, NanoslipError, Outcome, SingularOperator, SolverError
    from nanoslip.solver.simulate import DriveResult, contact_state, drive_result, friction_record
    from nanoslip.solver.slab import Slab
    from nanoslip.solver.sliding.plateau import Plateau, plateau_of
    from nanoslip.solver.sliding.power_law import Histogram, logarithmic_histogram
    from nanoslip.solver.sliding.record import FrictionRecord
    from nanoslip.solver.sliding.sizes import EventSizes, SizeDistribution, event_sizes, pooled, size_distribution
    from nanoslip.solver.sliding.statistics import event_statistics
    from nanoslip.study.api import concat, fit, run
    from nanoslip.study.api import open_dataset as open
    from nanoslip.study.dataset.variables import Described
    from nanoslip.study.dataset.variables import described as describe
    from nanoslip.study.figures.frames import frames
    from nanoslip.study.figures.sweep import figure
    from nanoslip.study.inference.fit import Fit
    from nanoslip.study.inference.sensitivity import Sensitivity, sensitivity
    from nanoslip.study.manifest.checker import ManifestError
    from nanoslip.study.results.store import StoreError

    __version__: str

__all__ = [
    "RK4",
    "Biquadratic",
    "Case",
    "Chain",
    "ContactState",
    "Described",
    "Drive",
    "DriveResult",
    "DynamicsResult",
    "Effects",
    "Ending",
    "EventSizes",
    "Exact",
    "Fit",
    "FrictionCoefficients",
    "FrictionRecord",
    "Galerkin",
    "HalfPlane",
    "Heterogeneity",
    "Histogram",
    "Interface",
    "InvalidInput",
    "ManifestError",
    "NanoslipError",
    "NoPlateauError",
    "Oscillator",
    "Outcome",
    "Plateau",
    "Scales",
    "Sensitivity",
    "SingularOperator",
    "SizeDistribution",
    "Slab",
    "SlipRule",
    "SolverError",
    "StoreError",
    "SurfaceCompliance",
    "cattaneo_mindlin",
    "concat",
    "contact_state",
    "describe",
    "drive_result",
    "event_sizes",
    "event_statistics",
    "figure",
    "fit",
    "flat_punch_pressure",
    "frames",
    "friction_record",
    "hertz",
    "logarithmic_histogram",
    "mirrored",
    "open",
    "plateau_of",
    "pooled",
    "run",
    "sensitivity",
    "size_distribution",
    "sliding_parabola",
    "sliding_punch",
    "stick_slip",
    "surface_compliance",
]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("nanoslip.study.provenance").version()
    if name not in __all__:
        raise AttributeError(f"module 'nanoslip' has no attribute {name!r}")
    module, theirs = _places()[name]
    found = getattr(importlib.import_module(module), theirs)
    globals()[name] = found
    return found


@cache
def _places() -> dict[str, tuple[str, str]]:
    """Public name -> module and name there, read off the imports above, which nothing but a type checker runs."""
    tree = ast.parse(Path(__file__).read_text("utf-8"))
    imports = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    return {alias.asname or alias.name: (str(node.module), alias.name) for node in imports for alias in node.names}


def __dir__() -> list[str]:
    return [*__all__, "__version__", "__doc__", "__file__", "__name__", "main"]


def main() -> None:
    """Run the command `nanoslip` with the words of the command line, and exit."""
    try:
        commands = importlib.import_module("nanoslip.study.commands.cli")
    except KeyboardInterrupt:  # as the commands do: one rank that ends by the signal takes the others with it
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
        raise
    commands.main()
