"""Spread tasks over processes of one machine without MPI: this process hands out, its children compute."""

from collections.abc import Sequence
from multiprocessing.connection import wait
from typing import Any, Final, TypeVar

from study.execution.dispatch import Dispatcher
from study.execution.farms.agent import Agent
from study.execution.farms.farm import LocalFarm, Returned, take_in
from study.execution.interruption import GRACE
from study.execution.ledger import Fail, Ledger, Report, Tally
from study.execution.queue import Work

PATIENCE: Final = 0.1
"""Seconds between looks whether a signal or a time limit has come, while no task ends."""

W = TypeVar("W", bound=Work)


class ProcessFarm(LocalFarm):
    """Processes of this machine that compute tasks, one of each agent."""

    def __init__(self, agents: Sequence[Agent], grace: float = GRACE) -> None:
        super().__init__(len(agents), grace)
        self.unit = "process" if len(agents) == 1 else "processes"
        self._agents = agents

    def __exit__(self, *error: object) -> None:
        for agent in self._agents:
            agent.close()
        super().__exit__(*error)

    def run(self, tasks: Sequence[W], report: Report[W], fail: Fail[W] = lambda *_: None) -> Tally:
        """Hand out tasks, idle processes first; several at once where they are short."""
        ledger = Ledger(tasks, report, fail)
        dispatcher = Dispatcher([agent.give for agent in self._agents])
        while ledger.unfinished and not (self.interruption.requested or ledger.halt):
            dispatcher.hand_out(ledger)
            self._arrivals(dispatcher, ledger)
            self._take_back(dispatcher.stranded(), dispatcher, ledger)
        self._take_back(range(self.size), dispatcher, ledger)
        while dispatcher.busy:
            self._arrivals(dispatcher, ledger)
        return ledger.tally(self.interruption.requested)

    def _arrivals(self, dispatcher: Dispatcher, ledger: Ledger[Any]) -> None:
        """Wait for news, and enter the tasks that have ended."""
        wait([agent.pipe for agent in self._agents if agent.busy and agent.pipe], PATIENCE)
        for number, agent in enumerate(self._agents):
            for done in agent.arrived():
                take_in(ledger, dispatcher, number, done)

    def _take_back(self, numbers: Sequence[int], dispatcher: Dispatcher, ledger: Ledger[Any]) -> None:
        for number in numbers:
            take_in(ledger, dispatcher, number, Returned(self._agents[number].give_back()))
