"""Compile the kernels that most tests run, while something else is checked: `make kernels`."""

from itertools import product

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.integrators import RK4
from nanoslip.study.run.warm_up import WarmUp, miniatures
from nanoslip.study.tasks.contact import contact_task
from nanoslip.study.tasks.drive import drive_task
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.task import Task
from tests.solver.drives import SMALL_TEETH

DRIVES = [
    {"reverse_motion": back, **way}
    for back, way in product((True, False), ({}, {"surface_compliance": False}, {"integrator": RK4(1e-3)}))
]
"""By every integrator, back or forward only."""
PULLED = ({}, {"scheme": "half_space"})
"""Contacts that drives are followed over event by event: of a row of nodes, and of a plane."""


def tasks() -> list[Task]:
    """Pins whose load or stage is raised, smooth or rough, slipping by turns or in rounds, one on a plane; and drives."""
    ways = product(("worst_first", "simultaneous"), ((), ((0.0, 0.0), (0.01, 1e-6), (0.02, 0.0))), ("stick", "gradual"))
    cases = [Case.of(dict(zip(("slip_order", "roughness", "initial_contact"), way, strict=True))) for way in ways]
    cases += [Case.of({"slip_order": order, "pin_translation": False}) for order in ("worst_first", "simultaneous")]
    cases += [Case.of({"scheme": "half_space"})]
    drives = (drive_task(Case(), Drive.from_si(**drive)) for drive in DRIVES)
    pulled = (drive_task(Case.of(contact), Drive.from_si(memory=True)) for contact in PULLED)
    return [contact_task(Case()), *map(record_task, cases), *drives, *pulled]


if __name__ == "__main__":
    WarmUp(miniatures(tasks())).run()
    for drive in DRIVES:  # over a profile that is not stored: its arrays may be written to, which makes other kernels
        SMALL_TEETH.driven(**drive, samples=2)
