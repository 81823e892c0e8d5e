"""Compile the kernels that most tests run, while something else is checked: `make kernels`."""

from itertools import product

from nanoslip.solver.case import Case
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.integrators import RK4
from nanoslip.study.run.executor import WarmUp, miniatures
from nanoslip.study.tasks.contact import contact_task
from nanoslip.study.tasks.drive import drive_task
from nanoslip.study.tasks.record import record_task
from nanoslip.study.tasks.task import Task
from tests.solver.drives import SMALL_TEETH

DRIVES = [
    {"reverse_motion": back, **way}
    for back, way in product((True, False), ({}, {"surface_compliance": False}, {"integrator": RK4(1e-3)}))
]
"""Drives by every integrator, back or forward only."""
ROUGH = ((0.0, 0.0), (0.01, 1e-6), (0.02, 0.0))
ROUGH_BALL = tuple((x, y, 1e-6 * (x > 0.0)) for x, y in product((0.0, 0.01), repeat=2))
PULLED = ({}, {"scheme": "half_space"}, {"roughness": ROUGH})
"""Contacts that drives are followed over event by event: of a row of nodes, smooth or rough, and of a plane."""


def tasks() -> list[Task]:
    """Pins whose load or stage is raised, smooth or rough, slipping by turns or in rounds, on rows and planes; and drives."""
    orders = ("worst_first", "simultaneous")
    ways = product(orders, ((), ROUGH), ("stick", "gradual"))
    cases = [Case.of(dict(zip(("slip_order", "roughness", "initial_contact"), way, strict=True))) for way in ways]
    cases += [Case.of({"slip_order": order, "pin_translation": False}) for order in orders]
    balls = product(orders, ((), ROUGH_BALL))
    cases += [Case.of({"scheme": "half_space", "slip_order": order, "roughness": rough}) for order, rough in balls]
    drives = (drive_task(Case(), Drive.from_si(**drive)) for drive in DRIVES)
    pulled = (drive_task(Case.of(contact), Drive.from_si(memory=True)) for contact in PULLED)
    return [contact_task(Case()), *map(record_task, cases), *drives, *pulled]


if __name__ == "__main__":
    WarmUp(miniatures(tasks())).run()
    for drive in DRIVES:  # over a profile that is not stored: its arrays may be written to, which makes other kernels
        SMALL_TEETH.driven(**drive, samples=2)
