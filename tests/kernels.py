"""Compile the kernels that most tests run, while something else is checked: `make kernels`."""

from nanoslip.solver.case import Case, Effects, SlipRule
from nanoslip.solver.drive import Drive
from nanoslip.solver.dynamics.integrators import RK4
from nanoslip.study.plan.kinds import contact_task, drive_task, record_task
from nanoslip.study.plan.task import Task
from nanoslip.study.run.executor import WarmUp, miniatures


def tasks() -> list[Task]:
    """Pins whose load or stage is raised, rough or slipping in rounds; drives by every integrator, back or forward only."""
    cases = [Case(initial_contact=way) for way in ("stick", "gradual")]
    cases += [Case(effects=Effects(pin_translation=False)), Case(slip_rule=SlipRule(residual_shear=1.0))]
    cases += [Case(slip_rule=SlipRule("simultaneous"))]
    cases += [Case.of({"roughness": ((0.0, 0.0), (0.01, 1e-6), (0.02, 0.0))})]
    drives = [
        Drive.from_si(reverse_motion=back, **way)
        for back in (True, False)
        for way in ({}, {"surface_compliance": False}, {"integrator": RK4(1e-3)})
    ]
    return [contact_task(Case()), *map(record_task, cases), *(drive_task(Case(), drive) for drive in drives)]


if __name__ == "__main__":
    WarmUp(miniatures(tasks())).run()
