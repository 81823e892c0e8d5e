"""Whatever can be written in a manifest is refused in words, or ends in results that obey the contact's laws or say why not.

Scenes are drawn from far beyond what is sensible; small grids and limits let thousands of them take a minute. Some are the same
every time, some others at every run, on a seed that is printed: driven, with every key, on large grids, over ranks; and what
failed once. A failure shows the seed and the whole scene. With the seed in NANOSLIP_SCENE_SEED the run is the same again; the
scene goes into `scenes` as a file that says what failed.
"""

import math
import os
import secrets
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, seed, settings, strategies as st

from nanoslip.solver.outcome import Ending
from nanoslip.solver.parameter import SHARED_ERROR
from nanoslip.solver.sliding.slide import slide_to_state
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.plan.expectations import memory_need
from nanoslip.study.plan.plan import make_plan
from nanoslip.study.tasks.compliance import task_compliance
from nanoslip.study.tasks.compute import run_task
from nanoslip.study.tasks.kind import member_column
from nanoslip.study.tasks.task import TaskResult
from tests.conftest import Command
from tests.hard_cases.scenery import campaigns, driven_scenes, scenes, strong_scenes
from tests.physics import assert_contact_laws, assert_friction_law

SEED = "NANOSLIP_SCENE_SEED"
KEPT = sorted((Path(__file__).parent / "scenes").glob("*.toml"))
OUT = Path("out", "results.nc")
MEMORY = 5e8
"""Bytes beyond which a scene is refused, as `nanoslip run` refuses what its machine has no room for: drawn at random, a plane of
257 by 257 nodes may lie in full contact, which takes tens of GB."""
TOO_LARGE = "refused: needs over 0.5 GB"
UNDRIVEN = {"refused", TOO_LARGE, Ending.INVALID, Ending.NEEDS_FAILED}
"""Endings of scenes whose drive never began."""


LONGEST = 60.0
"""Seconds after which a scene counts as one that never ends: limits on slips, events and segments keep all below a few."""
OPEN = ("gap", "restick_time", "restick_position")
"""May be infinite or missing: nodes beyond a punch's edges have no pin above them, a last slip may not have ended."""


REPEATED = ("regime", "stick_slip_period", "spring_force_amplitude", "spring_force_range")
"""Numbers that a drive has only if it is long enough to show it, or to forget its start."""
BURSTS = (
    *("mean_step", "mean_drop", "fluctuation", "critical_velocity"),
    *("time_stuck", "spring_force_amplitude", "stick_slip_period"),
)
"""Errors that starts share in short records, or repeat: their shared error is unknown."""
SHARES = ("fluctuation", "unseen_force", "equivalent_damping")
"""Numbers over the force of a plateau, or over the energy at a turn, which may be 0."""
KINETIC = ("kinetic_friction",)
LACKS = {
    Ending.NO_PLATEAU: (
        "plateau_mean", "plateau_stress", "plateau_std", "plateau_start", "plateau_end", "plateau_spacings", "plateau_peak",
        "plateau_drift", "plateau_event_drift", "plateau_stress_drift",
        "mean_step", "mean_slips", "mean_drop", *KINETIC,
    ),
    Ending.NO_SLIP: ("static_friction", *KINETIC),
}  # fmt: skip
"""Numbers that an outcome says are missing; a record without any event has no means over events either."""


def check(text: str, folder: Path) -> str:
    """Run a scene and hold it to the laws; returns how it ended."""
    path = folder / "scene.toml"
    path.write_text(text)
    try:
        plan = make_plan(load_manifest(path))
    except ManifestError as error:
        return "refused" if str(path) in str(error) else f"refused without saying where: {error}"
    if any(memory_need(task) > MEMORY for task in plan.tasks):
        return TOO_LARGE
    results: dict[str, TaskResult] = {}
    for task in plan.tasks:
        result = results[task.key] = run_task(task, results)
        assert result.outcome.ok or result.outcome.message, task.kind
        assert result.outcome.ending is not Ending.CRASHED
        if result.outcome.usable and result.scalars:
            _assert_finite(result)
        first = next(iter(result.members), result.outcome)  # an ensemble is usable without its first member
        if task.kind == "record" and first.usable:
            assert task.case is not None
            compliance = task_compliance(task, results)
            case = task.ensemble.case(task.case, 0)
            record, end = slide_to_state(case, compliance)
            np.testing.assert_array_equal(record.force_after, member_column(result, "force_after", "event"))
            assert np.all(np.diff(record.displacement) > 0.0)
            assert_friction_law(case, record, compliance)
            if case.effects.pin_translation:  # else it is carried along in thought only
                assert_contact_laws(end, case, compliance if case.effects.coupling else compliance.decouple())
    if not results:
        return str(plan.cases[0].outcome.ending)
    return str(results[plan.tasks[-1].key].outcome.ending)


def _excess(result: TaskResult) -> np.ndarray:
    """Part of the first slip's driving force that is inertia and damper, of each member; 0 where there is no drive."""
    members = len(next(iter(result.scalars.values())))
    return np.asarray(result.scalars.get("static_friction_excess", np.zeros(members)))


def _assert_finite(result: TaskResult) -> None:
    for name, array in result.arrays.items():
        assert name in OPEN or np.all(np.isfinite(array)), (result.kind, name)
    members = len(next(iter(result.scalars.values())))
    for member, outcome in enumerate(result.members or [result.outcome] * members):
        inertia = ("static_friction",) if _excess(result)[member] > 0.0 else ()
        lacking = (*REPEATED, *SHARES, *LACKS.get(outcome.ending, ()), *inertia)
        own = [numbers[member] for name, numbers in result.scalars.items() if not name.endswith(SHARED_ERROR)]
        refused = not outcome.ok and all(map(math.isnan, own))
        for name, numbers in result.scalars.items() if outcome.usable and not refused else ():
            missing = name.startswith("fit") or name.endswith("_excess") or name in lacking  # a fit needs slips
            if name.endswith(SHARED_ERROR):  # known of two starts or more that all have the number
                of = name.removesuffix(SHARED_ERROR)
                missing = of in BURSTS or members < 2 or not np.all(np.isfinite(result.scalars[of]))
            assert missing or not math.isnan(numbers[member]), (result.kind, name)


@pytest.fixture
def number(capsys: pytest.CaptureFixture[str]) -> int:
    """The seed of this run, printed whether the test passes or not: from the environment, else fresh."""
    given_seed = os.environ.get(SEED)
    number = int(given_seed) if given_seed else secrets.randbits(64)
    with capsys.disabled():
        print(f"\n{SEED}={number}")
    return number


def drawn(strategy: st.SearchStrategy[str], count: int, number: int) -> list[str]:
    """So many different texts, the same ones for the same number."""
    texts: list[str] = []

    # The stream is drawn before anything runs: what a scene does then cannot move it.
    @seed(number)
    @settings(
        max_examples=count,
        deadline=None,
        database=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(strategy)
    def draw(text: str) -> None:
        texts.append(text)

    draw()
    return texts


def tried(texts: list[str], number: int, folder: Path) -> Counter[str]:
    """Endings of the scenes; fails at the first that breaks a law, with its text."""
    endings: Counter[str] = Counter()
    for text in texts:
        try:
            ending, seconds = timed(text, folder)
            if seconds > LONGEST:  # may have compiled a kernel
                ending, seconds = timed(text, folder)
        except Exception as error:
            raise AssertionError(f"{SEED}={number}, {error!r} in the scene\n{text}") from error
        assert seconds < LONGEST, f"{SEED}={number}, {seconds:.0f} s for the scene\n{text}"
        assert ending in {"refused", TOO_LARGE, *Ending}, f"{SEED}={number}, {ending} in the scene\n{text}"
        endings[str(ending)] += 1
    print(", ".join(f"{ending}: {count}" for ending, count in sorted(endings.items())))
    return endings


def timed(text: str, folder: Path) -> tuple[str, float]:
    """Ending of a scene, and its seconds of processor time: a busy machine is no fault of the scene."""
    start = time.process_time()
    return check(text, folder), time.process_time() - start


@pytest.mark.parametrize("path", KEPT, ids=lambda path: path.stem)
def test_a_scene_that_once_failed_ends_in_a_lawful_result_or_a_named_refusal(path: Path, tmp_path: Path) -> None:
    tried([path.read_text("utf-8")], 0, tmp_path)


@pytest.mark.parametrize("count", [40, pytest.param(600, marks=pytest.mark.slow)])
def test_every_scene_ends_in_a_lawful_result_or_a_named_refusal(count: int, number: int, tmp_path: Path) -> None:
    """The everyday ones are the same at every run."""
    number = number if count > 40 else 0
    endings = tried(drawn(scenes(), count, number), number, tmp_path)
    whole = sum(endings[ending] for ending in (Ending.COMPLETED, Ending.NO_PLATEAU, Ending.NO_SLIP))
    assert whole > count // 10, f"{SEED}={number}: mere nonsense"


@pytest.mark.parametrize("count", [12, pytest.param(400, marks=pytest.mark.slow)])
def test_scenes_with_a_strength_end_in_a_lawful_result_or_a_named_refusal(
    count: int, number: int, tmp_path: Path
) -> None:
    """The everyday ones are the same at every run."""
    number = number if count > 12 else 2022
    endings = tried(drawn(strong_scenes(), count, number), number, tmp_path)
    whole = sum(endings[ending] for ending in (Ending.COMPLETED, Ending.NO_PLATEAU))
    assert whole > count // 3, f"{SEED}={number}: mere nonsense"


@pytest.mark.parametrize("count", [12, pytest.param(100, marks=pytest.mark.slow)])
def test_most_driven_scenes_reach_their_drive(count: int, number: int, tmp_path: Path) -> None:
    """The everyday ones are the same at every run."""
    number = number if count > 12 else 2022
    endings = tried(drawn(driven_scenes(), count, number), number, tmp_path)
    assert sum(endings[ending] for ending in set(endings) - UNDRIVEN) > count // 2, f"{SEED}={number}: {endings}"


@pytest.mark.slow
def test_fresh_scenes_on_large_grids(number: int, tmp_path: Path) -> None:
    tried(drawn(scenes(grids=(65, 129, 257), events=20), 60, number), number, tmp_path)


IN_TURN = """
import sys
from nanoslip.study.commands import cli
for folder in sys.argv[1:]:
    sys.argv = ["nanoslip", "run", f"{folder}/scene.toml", "--out", f"{folder}/out"]
    try:
        cli.main()
    except SystemExit as ended:
        print("exit", ended.code or 0)
"""


@pytest.mark.slow
@pytest.mark.mpi
def test_fresh_campaigns_have_the_same_dataset_on_two_ranks(
    number: int, nanoslip: Command, environment: dict[str, str], tmp_path: Path
) -> None:
    """Byte for byte, refusals included; a campaign that is refused is so in the same words. Without ranks one process
    computes all of them."""
    texts = drawn(campaigns(), 4, number)
    alone, over_ranks = ([tmp_path / f"{place} on {ranks}" for place in range(len(texts))] for ranks in (0, 2))
    for folder, text in zip((*alone, *over_ranks), texts * 2, strict=True):
        folder.mkdir()
        (folder / "scene.toml").write_text(text)
    words = [sys.executable, "-c", IN_TURN, *map(str, alone)]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, check=True, timeout=300)
    exits = [int(line.split()[1]) for line in done.stdout.splitlines() if line.startswith("exit ")]
    datasets = 0
    for text, expected, one, two in zip(texts, exits, alone, over_ranks, strict=True):
        done = nanoslip("run", two / "scene.toml", "--out", two / "out", ranks=2)
        complaint = f"{SEED}={number}, exits {expected} and {done.returncode} in the campaign\n{text}"
        assert done.returncode == expected, complaint
        assert "Traceback" not in done.stderr, complaint
        files = [found.read_bytes() if found.exists() else b"" for found in (one / OUT, two / OUT)]
        assert files[0] == files[1], complaint
        datasets += bool(files[0])
    print(f"{datasets} datasets of {len(texts)} campaigns")
    assert datasets > len(texts) // 3, f"{SEED}={number}: mere nonsense"
