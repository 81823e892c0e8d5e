"""Messages between ranks, whatever they say. None waits inside MPI: that would spin and take a core from those who compute."""

import time
from collections import deque
from typing import Any, Final

from nanoslip.study.execution.farms.pickling import dumps, loads

FLUSH: Final = 60.0
"""Seconds that the messages of a rank may take to leave it: a rank that does not listen any more takes none."""


class Mail:
    """What this rank sends to others and receives from them."""

    def __init__(self, mpi: Any) -> None:
        self._mpi = mpi
        self._world = mpi.COMM_WORLD
        self._sent: deque[Any] = deque()

    def send(self, rank: int, message: object) -> None:
        """Send a message to a rank, which need not be listening."""
        self._drop_gone()
        self._sent.append(self._world.isend(dumps(message), dest=rank))

    def flush(self) -> None:
        """Wait until all that was sent has left: what has not when MPI ends never does, and whom it was for waits for ever."""
        end = time.monotonic() + FLUSH
        self._drop_gone()
        while self._sent and time.monotonic() < end:
            time.sleep(1e-3)
            self._drop_gone()

    def _drop_gone(self) -> None:
        while self._sent and self._sent[0].test()[0]:
            self._sent.popleft()

    def received(self) -> list[tuple[int, Any]]:
        """All messages that have arrived, each with the rank that sent it."""
        status = self._mpi.Status()
        found = []
        while self._world.iprobe(source=self._mpi.ANY_SOURCE, tag=self._mpi.ANY_TAG, status=status):
            rank = status.Get_source()
            found.append((rank, loads(self._world.recv(source=rank))))
        return found
