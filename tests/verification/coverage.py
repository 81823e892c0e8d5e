"""Share of numbers whose ± holds, in fresh cases from all over the map, against long records of other starts.

`python -m tests.verification.coverage [DRAW] [CASES] [FIRST]` measures and writes the table, tests/verification/coverage.csv, or
its rows of one kind of draw, of so many cases: `sliding` ones from all over the map, a `path` back and forth, and rows of nodes
under a `slow` drive, where most stick and slip, or their `critical` velocity alone. A case takes some seconds, and is left out
where a record would take more than MOST events. A campaign of eight members is judged by one of others, whose records slide over
several node spacings, so that what all short records have in common shows, too. A path has no other length: it is compared with
more starts.
"""

import csv
import itertools
import math
import sys
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, NamedTuple, get_args

import numpy as np
import xarray as xr

import nanoslip
from nanoslip.solver.drive import Scales
from nanoslip.solver.sliding.validity import DOUBTFUL
from nanoslip.study.manifest.cases import make_campaign
from nanoslip.study.measured.columns import rows_as_csv
from nanoslip.study.tasks.kind import KINDS, result_quantities

Sort = Literal["plane strain", "three dimensions", "path"]
Draw = Literal["sliding", "path", "slow", "critical"]
"""Kind of a case: from all over the map, sliding or back and forth; a slow drive, and the critical velocity of one."""
SLOW: Final[tuple[Draw, ...]] = ("slow", "critical")
MEMBERS: Final = 8
OF_PATHS: Final = 24
"""Members that a path is compared with."""
SPACINGS: Final = (4.0, 2.2)
"""Node spacings of a long record, the first that takes fewer than MOST events."""
MOST: Final = 150_000
"""Events of a long record: more take too long, and the case is left out. A ball of 90 nodes has 60,000 in a node spacing."""
MOST_SLOW: Final = 7_000
"""Events of a long record with a slow drive: the search for its critical velocity takes far longer than the record."""
OTHERS: Final = 1.0 + 1e-9
"""Factor of the radius of the same case with other starts, which follow from it."""


class Pace(NamedTuple):
    """A law of draws for drives: stage velocities, and how many ask for the critical velocity."""

    slowest: float
    fastest: float
    """In F/√(km), the velocity at which a pin swings by all of its friction force."""
    asking: float


PACES: Final = {False: Pace(0.01, 1.0, 0.2), True: Pace(0.001, 0.03, 0.0)}
"""By whether a drive is slow: critical velocities of 16 cases are 0.0007 to 0.08 F/√(km), half of them above 0.028."""


class Scene(NamedTuple):
    """One case from the map: parameters of its campaign, by key."""

    sort: Sort
    case: Mapping[str, Any]
    drive: Mapping[str, Any]


def drawn(seed: int, is_slow: bool = False) -> Scene:
    """A case from all over the map, with a drive unless its pin goes back and forth.

    Schemes, layers 0.05 to 1, ν up to 0.5, slip rules, spreads, 7 to 24 nodes across, on a plane 20 to 90, μ_i 0.05 to 1.
    is_slow: a row of nodes with a slow drive.
    """
    # A last word of 0 leaves a generator as it is without.
    rng = np.random.default_rng([2032, seed, is_slow])
    shares = (1.0, 0.0, 0.0) if is_slow else (0.6, 0.2, 0.2)
    sort: Sort = str(rng.choice(get_args(Sort), p=shares))  # type: ignore[assignment]
    schemes = {
        "plane strain": ("galerkin", "biquadratic", "half_plane", "strip", "strip"),
        "three dimensions": ("half_space", "layer"),
        "path": ("galerkin", "half_plane", "strip", "half_space"),
    }
    scheme = str(rng.choice(schemes[sort]))
    planar, grid = scheme in ("half_space", "layer"), scheme in ("galerkin", "biquadratic")
    poisson = float(rng.uniform(0.0, 0.38 if grid else 0.5))
    n_x = int(rng.choice((17, 25) if planar else (33, 33, 33 if is_slow else 65)))
    load = 10.0 ** rng.uniform(-3.0, -1.8)
    across = rng.uniform(5.0, 11.0) if planar else math.exp(rng.uniform(math.log(7.0), math.log(24.0)))
    half_width = min(0.5 * across / (n_x - 1), 0.35)
    # Hertz: a³ = 3WR(1 - ν)/(8G) of a ball, a² = 2WR(1 - ν)/(πG) of a cylinder.
    ball, cylinder = 8.0 * half_width**2 / (6.0 * (1.0 - poisson)), half_width**2 * math.pi / (2.0 * (1.0 - poisson))
    case = {
        "scheme": scheme,
        "n_x": n_x,
        "poisson": poisson,
        "normal_load": 2.0 * half_width * load if planar else load,
        "radius": (ball if planar else cylinder) / load,
        "intrinsic_friction": math.exp(rng.uniform(math.log(0.05), 0.0)),
        "residual_shear": float(rng.choice([0.0, 0.0, 0.5, 0.9])),
        "spread": float(rng.choice([0.0, 0.0, 0.0, 0.1, 0.3])),
        "members": MEMBERS,
    }
    if scheme in ("strip", "layer"):
        case["aspect_ratio"] = math.exp(rng.uniform(math.log(0.2 if planar else 0.05), 0.0))
    if sort == "path":
        return Scene(sort, {**case, "amplitude": math.exp(rng.uniform(math.log(0.2), math.log(3.0))), "cycles": 4}, {})
    return Scene(sort, case, _driven(rng, case, PACES[is_slow]))


def _driven(rng: np.random.Generator, case: Mapping[str, Any], pace: Pace) -> dict[str, Any]:
    """A drive in SI from soft to stiff at a pace; half of them have a duration."""
    units, spring = Scales().units(0.5), 10.0 ** rng.uniform(-2.7, -1.3)
    force = case["intrinsic_friction"] * case["normal_load"]
    velocity = math.exp(rng.uniform(math.log(pace.slowest), math.log(pace.fastest))) * force / math.sqrt(spring)
    drive = {
        "spring_stiffness": spring * units["stiffness"],
        "pin_mass": 0.5,
        "stage_velocity": velocity * units["velocity"],
    }
    if rng.random() < 0.5:
        periods = 20.0 * 2.0 * math.pi / math.sqrt(spring)
        drive["duration"] = (3.0 * force / (spring * velocity) + periods) * units["time"]
    return {**drive, "critical": "true"} if rng.random() < pace.asking else drive


def computed(scene: Scene, **changed: Any) -> xr.Dataset:
    """The one case of a scene, with some parameters changed."""
    given = {key: str(value) for key, value in {**scene.case, **scene.drive, **changed}.items()}
    content = make_campaign(given, drive=bool(scene.drive))
    outputs = {**content.get("outputs", {}), "fit": False, "trajectory": False, "records": False}
    return nanoslip.run({**content, "outputs": outputs}, progress=False).squeeze()


def event_rate(found: xr.Dataset) -> float:
    """Events in a node spacing."""
    return float(found["events"] / found["record_spacings"])


def is_cheap(scene: Scene, most: float) -> bool:
    """True if the longest record takes fewer events than `most`, by a short one of a single start without the drive."""
    found = computed(scene._replace(drive={}), members=1)
    return found["outcome"].item() == "completed" and SPACINGS[0] * event_rate(found) < most


def known_better(scene: Scene, found: xr.Dataset, most: float) -> xr.Dataset | None:
    """Case that differs in starts and in longer records, on a path in more starts; None where that takes more events than
    `most`."""
    radius = scene.case["radius"] * OTHERS
    if scene.sort == "path":
        return computed(scene, radius=radius, members=OF_PATHS)
    rate = event_rate(found)
    spacings = next((each for each in SPACINGS if each * rate < most), None)
    if spacings is None:
        return None
    return computed(scene, radius=radius, seed=77, spacings=spacings, events=10 * MOST)


@dataclass(frozen=True)
class Verdict:
    """One number with ±, and how often that would have to be taken to reach the truth."""

    number: str
    sort: Sort
    case: int
    error: float
    """Value less truth, over the truth."""
    times: float
    """Difference over the ± of both; NaN where none was stated."""
    flagged: bool
    """True if a validity flag doubts the case."""


def numbers_of(found: xr.Dataset) -> list[str]:
    """Every number that a dataset states with a ±, known or not."""
    stated = [each for kind in KINDS.values() for each in result_quantities(kind).values() if each.ensemble]
    return list(dict.fromkeys(each.name for each in stated if each.uncertainty in found))


def scene_of(draw: Draw, number: int) -> Scene:
    """The case of this number in the sequence of a kind of draw."""
    scene = drawn(number, draw in SLOW)
    # The search takes ten times as long as the drive: cases that answer for it are others than those of the drive's own numbers.
    return scene._replace(drive={**scene.drive, "critical": "true"}) if draw == "critical" else scene


def verdicts(number: int, most: float | None = None, draw: Draw = "sliding") -> Iterator[Verdict]:
    """Each number of a case, and how far it is from that of other starts' long records of so many events."""
    scene = scene_of(draw, number)
    most = most or (MOST_SLOW if draw in SLOW else MOST)
    if draw in SLOW and not is_cheap(scene, most):
        return
    found = computed(scene)
    if found["outcome"].item() != "completed":
        return
    true = known_better(scene, found, most)
    if true is None or true["outcome"].item() != "completed":
        return
    doubts = int(found["validity_flags"]) | int(true["validity_flags"])
    for name in ("critical_velocity",) if draw == "critical" else numbers_of(found):
        value, truth = float(found[name]), float(true.get(name, math.nan))
        if not (math.isfinite(value) and math.isfinite(truth)) or _differ_in_regime(name, found, true):
            continue
        stated, its = (float(each[f"{name}_uncertainty"]) for each in (found, true))
        if math.isclose(value, truth, rel_tol=1e-9) and math.isnan(stated):  # all starts agree
            continue
        # Without a ± of its own it is no truth: some of its starts ended early, and the others are no fair sample.
        if math.isfinite(stated) and math.isnan(its):
            continue
        both = math.hypot(stated, its)
        error = value - truth
        yield Verdict(name, scene.sort, number, error / abs(truth or 1.0), error / both, bool(doubts & DOUBTFUL))


def _differ_in_regime(name: str, found: xr.Dataset, true: xr.Dataset) -> bool:
    """True of a number of one regime where starts have others: the regime is the answer then."""
    words = {
        each.name: each.alike for kind in KINDS.values() for each in result_quantities(kind).values() if each.alike
    }
    return name in words and found[words[name]].item() != true[words[name]].item()


def table(found: Sequence[Verdict]) -> Iterator[list[object]]:
    """Coverage by number: how often one and two ± hold, how large errors are, and how often no ± is stated."""
    groups: dict[str, list[Verdict]] = defaultdict(list)
    for verdict in found:
        groups[verdict.number].append(verdict)
    yield [
        "of",
        "cases",
        "± holds",
        "2 ± holds",
        "mean error over ±",
        "largest without flag",
        "median error",
        "not stated",
    ]
    for name, group in groups.items():
        times = np.array([each.times for each in group])
        stated = times[np.isfinite(times)]
        errors = np.abs([each.error for each in group if math.isfinite(each.times)])
        plain = [abs(each.times) for each in group if not each.flagged and math.isfinite(each.times)]
        once, twice = coverage(times)
        shares = [f"{once:.0%}", f"{twice:.0%}", f"{stated.mean():.1f}"] if len(stated) else ["–"] * 3
        largest = f"{max(plain):.1f}" if plain else "–"
        middle = f"{np.median(errors):.2%}" if len(errors) else "–"
        yield [name, len(group), *shares, largest, middle, f"{1.0 - len(stated) / len(group):.0%}"]


def coverage(times: np.ndarray) -> tuple[float, float]:
    """Share of stated uncertainties that hold once, and twice, as an average over what was stated."""
    stated = np.abs(times[np.isfinite(times)])
    return (float(np.mean(stated <= 1.0)), float(np.mean(stated <= 2.0))) if len(stated) else (math.nan, math.nan)


def numbers(draw: Draw, first: int) -> Iterator[int]:
    """Numbers of the cases of one kind of draw, from a number on."""
    everything = itertools.count(first)
    if draw in SLOW:
        return everything
    return (number for number in everything if (drawn(number).sort == "path") == (draw == "path"))


def measure(draw: Draw, wanted: int, first: int, path: Path) -> None:
    """Write the rows of so many cases of one kind of draw; an interrupted run leaves those of the cases before."""
    found, taken = list[Verdict](), 0
    for number in numbers(draw, first):
        new = list(verdicts(number, draw=draw))
        found += new
        taken += bool(new)
        replace_rows(path, draw, found)
        print(f"case {number}, {draw}: {taken if new else 'left out'}", file=sys.stderr, flush=True)
        if taken == wanted:
            return


def replace_rows(path: Path, draw: Draw, found: Sequence[Verdict]) -> None:
    """Write the rows of one kind of draw into a table in place of its earlier ones; two processes may measure two kinds."""
    header, *rows = table(found)
    written = path.read_text("utf-8").splitlines()[1:]
    tables = {each: [row for row in csv.reader(written) if row[0] == each] for each in get_args(Draw)}
    tables[draw] = [[draw, *map(str, row)] for row in rows]
    every = itertools.chain(*tables.values())
    path.write_text(rows_as_csv([["draw", *header], *every]), "utf-8")


if __name__ == "__main__":
    draw, wanted, number = (*sys.argv[1:], *("", "60", "0")[len(sys.argv) - 1 :])
    for each in (draw,) if draw else get_args(Draw):
        measure(each, int(wanted), int(number), Path(__file__).with_suffix(".csv"))
