"""Kill runs at random moments and look at what comes of it: `python -m tests.mpi.kills --trials 100`.

In a trial a run is killed at a moment drawn at random, then goes on with other ranks; what must hold is looked at.
"""

import argparse
import os
import random
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

from nanoslip.study.dataset import file
from nanoslip.study.exit_codes import INTERRUPTED, WRONG_INPUT
from nanoslip.study.results import store as lease
from nanoslip.study.results.entry import ENDING
from nanoslip.study.results.files import lives
from nanoslip.study.results.store import FOLDER
from nanoslip.study.run.journal import BEGUN
from tests.conftest import SMALL, clean_environment, launcher
from tests.study.results.results import written

KEPT: Final = SMALL.replace("[0.25, 0.5]", "[0.25, 0.3, 0.4, 0.5]").replace("[50.0, 100.0]", "[50, 60, 70, 80, 100]")
CAMPAIGNS: Final = {"kept": KEPT, "scalars": f"{KEPT}records = false\ntrajectory = false\n"}
"""Name -> a campaign of short tasks: one of 61 keeps all, one of 81 only scalars, so that 20 records go when they were driven."""
PATIENCE: Final = 120.0
"""Seconds after which a run is taken to hang; each takes a few."""
LATEST: Final = 0.95
"""Part of the time of an undisturbed run after which nothing is killed any more."""

# The processes of one run, found by a word in their environment: its launcher, its ranks, those that compute.

MARK: Final = "NANOSLIP_TRIAL"
"""Variable of the environment that all processes of a run inherit."""
RANK: Final = (b"PMI_RANK=", b"OMPI_COMM_WORLD_RANK=")
"""How launchers tell a process which rank it is."""
TARGETS: Final = ("launcher", "rank 0", "another rank", "a child", "all of them")
SIGNALS: Final = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT, signal.SIGUSR1)
KINDS: Final = tuple((target, sent) for target in TARGETS for sent in SIGNALS)


def marked(mark: str) -> Iterator[tuple[int, list[bytes], list[bytes]]]:
    """The processes of a run that live: number, words of the command, environment."""
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError):
            environment = (folder / "environ").read_bytes().split(b"\0")
            if f"{MARK}={mark}".encode() in environment:
                yield int(folder.name), (folder / "cmdline").read_bytes().split(b"\0"), environment


def remaining(mark: str) -> list[int]:
    """Those of them that have not ended."""
    return [process for process, _, _ in marked(mark) if lives(process)]


def killed(mark: str) -> int:
    """Kill what is left of a run; how many processes that were."""
    left = remaining(mark)
    for process in left:
        with suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    return len(left)


def meant(target: str, mark: str, launched: int) -> list[int]:
    """The processes of a run that are meant by the name of a target."""
    if target in ("launcher", "all of them"):
        return [launched]
    ranks, children = {}, []
    for process, words, environment in marked(mark):
        number = next((int(each.partition(b"=")[2]) for each in environment if each.startswith(RANK)), None)
        if any(b"nanoslip.study.run.child" in word for word in words):
            children.append(process)
        elif number is not None and b"nanoslip" in words:
            ranks[number] = process
    if target == "a child":
        return sorted(children)
    return sorted(process for number, process in ranks.items() if (number == 0) == (target == "rank 0"))


def kill(target: str, process: int, sent: signal.Signals) -> bool:
    """Send a process, or all of a launcher's group, a signal; False where it has ended."""
    with suppress(ProcessLookupError):
        (os.killpg if target == "all of them" else os.kill)(process, sent)
        return True
    return False


# Runs of a campaign in processes of their own, and what they leave in its folder.


@dataclass(frozen=True)
class Undisturbed:
    """What a campaign comes to that nobody kills."""

    campaign: Path
    dataset: bytes
    written: Counter[str]
    seconds: float
    """How long it took on two ranks."""


def start(campaign: Path, out: Path, ranks: int, said: Path, mark: str = "") -> "subprocess.Popen[bytes]":
    """Begin a run in a session of its own; what it says goes to a file, which outlives pipes. mark: where `out` is not enough."""
    words = [*launcher(ranks), sys.executable, "-m", "nanoslip", "run", str(campaign), "--out", str(out)]
    environment = clean_environment() | {MARK: mark or str(out)}
    none = subprocess.DEVNULL
    with said.open("ab") as log:
        return subprocess.Popen(words, env=environment, stdin=none, stdout=log, stderr=log, start_new_session=True)


def undisturbed(folder: Path) -> list[Undisturbed]:
    """Run each campaign on two ranks. Raises RuntimeError where that fails."""
    found = []
    for name, text in CAMPAIGNS.items():
        campaign, out, said = folder / f"{name}.toml", folder / name, folder / f"{name}.said"
        campaign.write_text(text, "utf-8")
        begun = time.monotonic()
        if start(campaign, out, 2, said).wait(PATIENCE):
            raise RuntimeError(said.read_text("utf-8"))
        seconds = time.monotonic() - begun
        found.append(Undisturbed(campaign, (out / file.FILE).read_bytes(), written(out), seconds))
    return found


class Rival:
    """A launch of a campaign that is begun again, with other ranks, until it ends well."""

    def __init__(self, campaign: Path, out: Path, drawn: random.Random, said: Path) -> None:
        self.said, self.mark = said, f"{out} {said.suffix}"
        self.codes: list[int] = []
        """How it has ended so far, each time."""
        self._begin = lambda: start(campaign, out, drawn.choice((0, 1, 2, 4)), said, self.mark)
        self.running = self._begin()

    def done(self) -> bool:
        """Whether it has ended well; else it is begun again where it has ended, and nothing of it is left."""
        if self.codes[-1:] != [0] and (code := self.running.poll()) is not None and not remaining(self.mark):
            self.codes.append(code)
            if code:
                self.running = self._begin()
        return self.codes[-1:] == [0]


def own_files(out: Path) -> dict[str, int]:
    """Results in files of their own, and what tells each from one that was written anew."""
    return {path.name: path.stat().st_ino for path in (out / FOLDER).glob(f"*{ENDING}")}


def logs(out: Path) -> dict[str, bytes]:
    """Name -> content of each log."""
    return {path.name: path.read_bytes() for path in (out / FOLDER).glob("*.log")}


# A trial.

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
    broken: list[str] = field(default_factory=list)
    """What should have held and did not."""

    def holds(self, law: bool, otherwise: str) -> None:
        """Note what is broken where a law does not hold."""
        if not law:
            self.broken.append(otherwise)

    def heard(self, said: Path) -> None:
        """Look at what a run has said."""
        words = said.read_text("utf-8", errors="replace")
        told = "Traceback" in words and (self.sent is not signal.SIGINT or OURS.search(words))
        self.holds(not told, f"a traceback: {words.strip()[-300:]!r}")

    def left(self, whole: Undisturbed, out: Path) -> None:
        """Look at what a run has left: the same dataset, no scratch file, lease or word of tasks, each result once.

        A child that is killed between keeping a result and telling of it takes that task with it: it is done again.
        """
        dataset, kept = out / file.FILE, written(out)
        self.holds(dataset.exists() and dataset.read_bytes() == whole.dataset, "no dataset, or another one")
        hidden = [*out.glob(".*"), *(out / FOLDER).glob(".*"), *out.glob("*set-aside*")]
        for path in (*hidden, out / lease.FILE, out / BEGUN):
            self.holds(not path.exists(), f"left {path.name}")
        more, less = (kept - whole.written).total(), (whole.written - kept).total()
        self.holds(more <= (self.target == "a child"), f"{more} results kept twice")
        self.holds(less == 0, f"{less} results missing")


def run(number: int, seed: int, campaigns: list[Undisturbed], folder: Path) -> Trial:
    """Make the trial of this number; the same seed draws the same moments."""
    drawn = random.Random(f"{seed} {number}")
    found, whole = Trial(number, *KINDS[number % len(KINDS)]), drawn.choice(campaigns)
    ranks, later = drawn.choice((2, 4) if found.target == "another rank" else (1, 2, 4)), drawn.choice((0, 1, 2, 4))
    out, said = folder / f"trial{number}", folder / f"trial{number}.said"
    running = start(whole.campaign, out, ranks, said)
    come = _moment(drawn, whole, out)
    while running.poll() is None and not found.killed:
        if come() and (processes := meant(found.target, str(out), running.pid)):
            found.killed = kill(found.target, drawn.choice(processes), found.sent)
        time.sleep(0.002)
    sent = time.monotonic()
    with suppress(subprocess.TimeoutExpired):
        running.wait(PATIENCE)
    while remaining(str(out)) and time.monotonic() < sent + PATIENCE:
        time.sleep(0.02)
    left = killed(str(out))
    found.holds(not left, f"{left} processes left after {PATIENCE:g} s")
    running.wait(PATIENCE)
    found.heard(said)
    dataset = out / file.FILE
    found.holds(not dataset.exists() or dataset.read_bytes() == whole.dataset, "left another dataset")
    _go_on(found, whole, out, later)
    return found


def _go_on(found: Trial, whole: Undisturbed, out: Path, ranks: int) -> None:
    """Run again, and look at all that must hold then."""
    kept, files, said = logs(out), own_files(out), out.with_suffix(".later")
    again = start(whole.campaign, out, ranks, said)
    try:
        code = again.wait(PATIENCE)
    except subprocess.TimeoutExpired:
        os.killpg(again.pid, signal.SIGKILL)
        code = again.wait()
    found.heard(said)
    found.holds(code == 0, f"went on to exit code {code}: {said.read_text('utf-8', errors='replace')[-300:]!r}")
    found.left(whole, out)
    now, after = logs(out), own_files(out)
    for name, content in kept.items():
        found.holds(content.startswith(now.get(name, b"gone")), f"{name} was written anew")
    for name, inode in files.items():
        found.holds(after.get(name, inode) == inode, f"{name} was written anew")
    left = killed(str(out))
    found.holds(not left, f"{left} processes left by the run that went on")


def race(number: int, seed: int, campaigns: list[Undisturbed], folder: Path) -> Trial:
    """The same with two launches that race for one campaign, each begun again until it ends well; one of them is hit."""
    drawn = random.Random(f"race {seed} {number}")
    found = Trial(number, *KINDS[number % len(KINDS)])
    whole, out = drawn.choice(campaigns), folder / f"race{number}"
    rivals = [Rival(whole.campaign, out, drawn, out.with_suffix(f".{name}")) for name in ("one", "other")]
    come, until = _moment(drawn, whole, out), time.monotonic() + PATIENCE
    while [rival for rival in rivals if not rival.done()] and time.monotonic() < until:
        hit = drawn.choice(rivals)
        if not found.killed and hit.running.poll() is None and come():
            processes = meant(found.target, hit.mark, hit.running.pid)
            found.killed = bool(processes) and kill(found.target, drawn.choice(processes), found.sent)
        time.sleep(0.002)
    # Well, refused as the other is at work, or told to stop; and what was hit as the signal has it.
    codes = [code for rival in rivals for code in rival.codes]
    others = [code for code in codes if code not in (0, WRONG_INPUT, INTERRUPTED)]
    found.holds(len(others) <= found.killed, f"exit codes {others}")
    for rival in rivals:
        killed(rival.mark)
        rival.running.wait(PATIENCE)
        found.heard(rival.said)
        words = rival.said.read_text("utf-8", errors="replace")[-300:]
        found.holds(rival.codes[-1:] == [0], f"not done, exit codes {rival.codes}: {words!r}")
    found.left(whole, out)
    return found


def _moment(drawn: random.Random, whole: Undisturbed, out: Path) -> Callable[[], bool]:
    """When to kill, by the clock or by what is finished: else most moments would be those of a start."""
    if drawn.random() < 0.5:
        moment = time.monotonic() + drawn.uniform(0.0, whole.seconds * LATEST)
        return lambda: time.monotonic() >= moment
    results = drawn.randint(1, len(whole.written))
    return lambda: len(written(out)) >= results


def main() -> None:
    """Make the trials that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="number of the first trial: one that broke, again")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--race", action="store_true", help="two launches race in each trial")
    asked = parser.parse_args()
    found = []
    with TemporaryDirectory() as folder:
        campaigns = undisturbed(Path(folder))
        for number in range(asked.first, asked.first + asked.trials):
            found.append((race if asked.race else run)(number, asked.seed, campaigns, Path(folder)))
            print(found[-1], flush=True)
    broken, late = sum(bool(each.broken) for each in found), sum(not each.killed for each in found)
    print(f"{len(found)} trials, {broken} broken; {late} runs had ended before what was to be killed was there.")
    sys.exit(any(each.broken for each in found))


if __name__ == "__main__":
    main()
