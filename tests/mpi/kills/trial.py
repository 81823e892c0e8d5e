"""One trial: a run is killed at a moment drawn at random, then goes on with other ranks; what must hold is looked at."""

import os
import random
import re
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from nanoslip.study.dataset import file
from nanoslip.study.exit_codes import INTERRUPTED, WRONG_INPUT
from tests.mpi.kills import processes
from tests.mpi.kills.running import PATIENCE, Rival, Undisturbed, logs, own_files, remains, start
from tests.study.results.results import written

SIGNALS: Final = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGUSR1)
KINDS: Final = tuple((target, sent) for target in processes.TARGETS for sent in SIGNALS)
LATEST: Final = 0.95
"""Part of the time of an undisturbed run after which nothing is killed any more."""


OURS: Final = re.compile(r'nanoslip/__init__\.py", line \d+, in main')
"""Where nanoslip hears Ctrl-C. While Python itself starts, the last words are Python's."""


@dataclass
class Trial:
    """A trial and what came of it."""

    number: int
    target: str
    sent: signal.Signals
    killed: bool = False
    """Whether what was to be killed was there before the run had ended."""
    code: int = 0
    """How the run ended that was killed."""
    finished: int = 0
    """Results that it had kept by then."""
    ended_after: float = 0.0
    """Seconds from the kill until no process of the run was left."""
    went_on_in: float = 0.0
    """Seconds that the run after it took."""
    broken: list[str] = field(default_factory=list)
    """What should have held and did not."""


def run(number: int, seed: int, campaigns: list[Undisturbed], folder: Path) -> Trial:
    """Make the trial of this number; the same seed draws the same moments."""
    drawn = random.Random(f"{seed} {number}")
    target, sent = KINDS[number % len(KINDS)]
    whole = drawn.choice(campaigns)
    ranks, later = drawn.choice((2, 4) if target == "another rank" else (1, 2, 4)), drawn.choice((0, 1, 2, 4))
    out, said = folder / f"trial{number}", folder / f"trial{number}.said"
    found = Trial(number, target, sent)
    running = start(whole.campaign, out, ranks, said)
    come = _moment(drawn, whole, out)
    process = _victim(drawn, come, lambda: processes.found(target, str(out), running.pid), running)
    found.killed = process is not None and processes.kill(target, process, sent)
    _wait_for_end(found, running, str(out))
    found.finished = len(written(out))
    _told(found, said)
    _go_on(found, whole, out, later)
    return found


def race(number: int, seed: int, campaigns: list[Undisturbed], folder: Path) -> Trial:
    """The same with two launches that race for one campaign, each begun again until it ends well; one of them is hit."""
    drawn = random.Random(f"race {seed} {number}")
    target, sent = KINDS[number % len(KINDS)]
    whole, out = drawn.choice(campaigns), folder / f"race{number}"
    found = Trial(number, target, sent)
    rivals = [Rival(whole.campaign, out, drawn, out.with_suffix(f".{name}")) for name in ("one", "other")]
    come, until, killed = _moment(drawn, whole, out), time.monotonic() + PATIENCE, 0.0
    while [rival for rival in rivals if not rival.done()] and time.monotonic() < until:
        hit = drawn.choice(rivals)
        if not found.killed and hit.code is None and come() and (meant := _meant(target, str(out), hit)):
            found.killed, killed = processes.kill(target, drawn.choice(meant), sent), time.monotonic()
            found.finished = len(written(out))
        time.sleep(0.002)
    found.went_on_in = time.monotonic() - killed if found.killed else 0.0
    # Well, refused as the other is at work, or told to stop; and what was hit as the signal has it.
    others = [code for rival in rivals for code in rival.codes if code not in (0, WRONG_INPUT, INTERRUPTED)]
    found.code = next(iter(others), max((code for rival in rivals for code in rival.codes), default=0))
    if len(others) > found.killed:
        found.broken.append(f"exit codes {others}")
    for rival in rivals:
        rival.end()
        _told(found, rival.said)
        if rival.codes[-1:] != [0]:
            found.broken.append(f"not done, exit codes {rival.codes}: {rival.words()[-300:]!r}")
    if (dataset := out / file.FILE).exists() and dataset.read_bytes() != whole.dataset:
        found.broken.append("another dataset")
    found.broken += [*remains(out), *_twice(found, whole.written, written(out))]
    return found


def _meant(target: str, mark: str, hit: Rival) -> list[int]:
    """The processes of a launch that are meant."""
    return sorted(processes.found(target, f"{mark} {hit.said.suffix}", hit.running.pid))


def _moment(drawn: random.Random, whole: Undisturbed, out: Path) -> Callable[[], bool]:
    """When to kill, by the clock or by what is finished: else most moments would be those of a start."""
    if drawn.random() < 0.5:
        moment = time.monotonic() + drawn.uniform(0.0, whole.seconds * LATEST)
        return lambda: time.monotonic() >= moment
    results = drawn.randint(1, len(whole.written))
    return lambda: len(written(out)) >= results


def _victim(
    drawn: random.Random, come: Callable[[], bool], find: Callable[[], list[int]], running: "subprocess.Popen[bytes]"
) -> int | None:
    """A process of those meant, when its moment has come; None where the run has ended before."""
    while running.poll() is None:
        if come() and (meant := find()):
            return drawn.choice(sorted(meant))
        time.sleep(0.002)
    return None


def _wait_for_end(found: Trial, running: "subprocess.Popen[bytes]", mark: str) -> None:
    begun = time.monotonic()
    with suppress(subprocess.TimeoutExpired):
        running.wait(PATIENCE)
    while (left := processes.remaining(mark)) and time.monotonic() < begun + PATIENCE:
        time.sleep(0.02)
    found.ended_after = time.monotonic() - begun
    if left:
        found.broken.append(f"{len(left)} processes left after {PATIENCE:g} s")
        for process in left:
            with suppress(ProcessLookupError):
                os.kill(process, signal.SIGKILL)
    found.code = running.wait(PATIENCE)


def _told(found: Trial, said: Path) -> None:
    words = said.read_text("utf-8", errors="replace")
    if "Traceback" in words and (found.sent is not signal.SIGINT or OURS.search(words)):
        found.broken.append(f"a traceback: {words.strip().splitlines()[-1]}")


def _go_on(found: Trial, whole: Undisturbed, out: Path, ranks: int) -> None:
    """Run again, and look at all that must hold then."""
    kept, files, said = logs(out), own_files(out), out.with_suffix(".later")
    dataset = out / file.FILE
    if dataset.exists() and dataset.read_bytes() != whole.dataset:
        found.broken.append("left another dataset")
    begun = time.monotonic()
    again = start(whole.campaign, out, ranks, said)
    try:
        code = again.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(again.pid, signal.SIGKILL)
        code = again.wait()
    found.went_on_in = time.monotonic() - begun
    _told(found, said)
    if code != 0:
        found.broken.append(f"went on to exit code {code}: {said.read_text('utf-8', errors='replace')[-300:]!r}")
    elif dataset.read_bytes() != whole.dataset:
        found.broken.append("another dataset")
    found.broken += [*remains(out), *_twice(found, whole.written, written(out)), *_changed(out, kept, files)]
    if left := processes.remaining(str(out)):
        found.broken.append(f"{len(left)} processes left by the run that went on")


def _twice(found: Trial, expected: Counter[str], kept: Counter[str]) -> list[str]:
    """What was kept more or less often than by a run that nobody kills.

    A child that is killed between keeping a result and telling of it takes that task with it: it is done again.
    """
    more, allowed = (kept - expected).total(), int(found.target == "a child")
    less = (expected - kept).total()
    return [*([f"{more} results kept twice"] if more > allowed else []), *([f"{less} results missing"] if less else [])]


def _changed(out: Path, kept: dict[str, bytes], files: dict[str, int]) -> list[str]:
    """What was finished before and has been written anew."""
    after = own_files(out)
    anew = [name for name, number in files.items() if after.get(name, number) != number]
    now = logs(out)
    torn = [name for name, content in kept.items() if not content.startswith(now.get(name, b"gone"))]
    return [f"{name} was written anew" for name in (*anew, *torn)]
