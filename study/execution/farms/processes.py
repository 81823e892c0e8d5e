"""Spread tasks over processes of one machine without MPI: this process hands out, its children compute."""

from collections.abc import Sequence
from multiprocessing import connection
from typing import Any, Final

from nanoslip.study.execution.farms.agent import Agent
from nanoslip.study.execution.farms.coordinator import Coordinator
from nanoslip.study.execution.farms.farm import LocalFarm
from nanoslip.study.execution.farms.outbox import News, news_of
from nanoslip.study.execution.interruption import GRACE

PATIENCE: Final = 0.1
"""Seconds between looks whether a signal or a time limit has come, while no task ends."""


class ProcessFarm(Coordinator, LocalFarm):
    """Processes of this machine that compute tasks, one of each agent."""

    def __init__(self, agents: Sequence[Agent], grace: float = GRACE) -> None:
        super().__init__(len(agents), grace)
        self.unit = "process" if len(agents) == 1 else "processes"
        self._agents = agents

    def __exit__(self, *error: object) -> None:
        for agent in self._agents:
            agent.close()
        super().__exit__(*error)

    def give(self, rank: int, tasks: list[Any]) -> None:
        """Have a process compute tasks, behind those that it has."""
        self._agents[rank].give(tasks)

    def take_back(self, rank: int) -> tuple[str, ...]:
        """Have a process return the tasks that it has not begun, and say their keys."""
        return self._agents[rank].give_back()

    def news(self) -> list[tuple[int, News]]:
        """The tasks that have ended; waits a little for one, where none has."""
        connection.wait([agent.pipe for agent in self._agents if agent.busy and agent.pipe], PATIENCE)
        return [(number, news_of(agent.arrived())) for number, agent in enumerate(self._agents)]
