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

`run`, `records`, `open`, `concat`, `figure` and `describe` are of campaigns and datasets, whose accessor `.nanoslip` finds
records, trajectories and contacts; everything else is of single cases. Results are one line in a console; `.plot()` draws them,
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
    from nanoslip.solver.case import (
        Case as Case,
        Effects as Effects,
        Heterogeneity as Heterogeneity,
        Interface as Interface,
        SlipRule as SlipRule,
    )
    from nanoslip.solver.contact.closed_forms import (
        cattaneo_mindlin as cattaneo_mindlin,
        flat_punch_pressure as flat_punch_pressure,
        hertz as hertz,
        sliding_parabola as sliding_parabola,
        sliding_punch as sliding_punch,
    )
    from nanoslip.solver.contact.state import ContactState as ContactState
    from nanoslip.solver.drive import Drive as Drive, Scales as Scales
    from nanoslip.solver.dynamics.coefficients import FrictionCoefficients as FrictionCoefficients
    from nanoslip.solver.dynamics.friction_limit import NoPlateauError as NoPlateauError
    from nanoslip.solver.dynamics.integrators import RK4 as RK4, Exact as Exact
    from nanoslip.solver.dynamics.result import DynamicsResult as DynamicsResult
    from nanoslip.solver.dynamics.stick_slip import Oscillator as Oscillator, stick_slip as stick_slip
    from nanoslip.solver.elasticity.compliance import (
        SurfaceCompliance as SurfaceCompliance,
        surface_compliance as surface_compliance,
    )
    from nanoslip.solver.elasticity.schemes import (
        Biquadratic as Biquadratic,
        Chain as Chain,
        Galerkin as Galerkin,
        HalfPlane as HalfPlane,
        HalfSpace as HalfSpace,
        Layer as Layer,
        Strip as Strip,
    )
    from nanoslip.solver.ensemble import Mean as Mean, mean_of as mean_of
    from nanoslip.solver.load_path import LoadPath as LoadPath, Loops as Loops
    from nanoslip.solver.outcome import (
        Ending as Ending,
        InvalidInput as InvalidInput,
        NanoslipError as NanoslipError,
        Outcome as Outcome,
        SingularOperator as SingularOperator,
        SolverError as SolverError,
    )
    from nanoslip.solver.simulate import (
        DriveResult as DriveResult,
        contact_state as contact_state,
        drive_result as drive_result,
        friction_path as friction_path,
        friction_record as friction_record,
    )
    from nanoslip.solver.slab import Slab as Slab
    from nanoslip.solver.sliding.path import Leg as Leg, loops_of as loops_of
    from nanoslip.solver.sliding.plateau import Plateau as Plateau, plateau_of as plateau_of
    from nanoslip.solver.sliding.power_law import Histogram as Histogram, logarithmic_histogram as logarithmic_histogram
    from nanoslip.solver.sliding.record import FrictionRecord as FrictionRecord
    from nanoslip.solver.sliding.sizes import (
        EventSizes as EventSizes,
        SizeDistribution as SizeDistribution,
        event_sizes as event_sizes,
        pool_events as pool_events,
        size_distribution as size_distribution,
    )
    from nanoslip.solver.sliding.statistics import event_statistics as event_statistics
    from nanoslip.study.api import concat as concat, fit as fit, open as open, records as records, run as run
    from nanoslip.study.dataset.variables import Described as Described, describe as describe
    from nanoslip.study.figures.answer import figure as figure
    from nanoslip.study.figures.frames import frames as frames
    from nanoslip.study.inference.fit import Fit as Fit
    from nanoslip.study.inference.sensitivity import Sensitivity as Sensitivity, sensitivity as sensitivity
    from nanoslip.study.manifest.problems import ManifestError as ManifestError
    from nanoslip.study.results.store import StoreError as StoreError

    __all__: list[str]
    __version__: str


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return importlib.import_module("nanoslip.study.provenance").version()
    if name == "__all__":
        return sorted(_places())
    if name not in _places():
        raise AttributeError(f"module 'nanoslip' has no attribute {name!r}")
    found = getattr(importlib.import_module(_places()[name]), name)
    globals()[name] = found
    return found


@cache
def _places() -> dict[str, str]:
    """Public name -> its module, read off the imports above, which nothing but a type checker runs."""
    tree = ast.parse(Path(__file__).read_text("utf-8"))
    imports = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    return {alias.name: str(node.module) for node in imports for alias in node.names if alias.asname}


def __dir__() -> list[str]:
    return [*_places(), "__all__", "__version__", "__doc__", "__file__", "__name__", "main"]


def main() -> None:
    """Run the command `nanoslip` with the words of the command line, and exit."""
    try:
        commands = importlib.import_module("nanoslip.study.commands.cli")
    except KeyboardInterrupt:  # as the commands do: one rank that ends by the signal takes the others with it
        signal.signal(signal.SIGINT, signal.SIG_DFL)
        os.kill(os.getpid(), signal.SIGINT)
        raise
    commands.main()
