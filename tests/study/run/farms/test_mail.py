"""Nobody ends with messages still on their way, and nobody waits for ever for a rank that takes none."""

from types import SimpleNamespace
from typing import Any

import pytest

from nanoslip.study.run import mail
from nanoslip.study.run.mail import Mail


class Request:
    """A message that has left at the given look at it."""

    def __init__(self, looks: float) -> None:
        self.looks = looks

    def test(self) -> tuple[bool, None]:
        self.looks -= 1
        return self.looks <= 0, None


def mail_of(*requests: Request) -> Mail:
    """One whose messages leave as the requests say."""
    waiting = iter(requests)
    mpi: Any = SimpleNamespace(COMM_WORLD=SimpleNamespace(isend=lambda _text, dest: next(waiting)))
    found = Mail(mpi)
    for _ in requests:
        found.send(1, "word")
    return found


def test_a_rank_waits_until_all_that_it_sent_has_left() -> None:
    requests = [Request(looks) for looks in (5, 1, 9)]
    mail_of(*requests).flush()
    assert all(each.looks <= 0 for each in requests)


def test_it_gives_up_where_nobody_takes_a_message(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(mail, "FLUSH", 0.05)
    deaf = Request(float("inf"))
    mail_of(deaf).flush()
    assert deaf.looks == float("inf")
