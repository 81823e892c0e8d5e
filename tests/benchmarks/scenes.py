"""What each effect changes and costs in three scenes, as `nanoslip effects` measures it: `python -m tests.benchmarks.scenes`.

One case of eight members each. It writes tests/benchmarks/scenes.csv.
"""

import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from nanoslip.solver.view import with_error
from nanoslip.study.accuracy.effects import Influence, influences, select_scenes
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.manifest import USUAL_MEMBERS
from nanoslip.study.manifest.reader import load_manifest
from nanoslip.study.shipped import campaign_files
from tests.written_tables import show

SCENES: Final = {"the paper's pin": "smoke", "a ball on rubber": "starters/ball", "an AFM tip": "starters/afm"}
"""Name of a scene -> its campaign."""
HEADER: Final = ("scene", "without", "number", "change", "time")


def influences_of(campaign: str) -> list[Influence]:
    """Influence of each effect of the first case of a campaign."""
    manifest = load_manifest(campaign_files()[campaign])
    found, failures = influences(select_scenes(manifest, expand(manifest), 1, USUAL_MEMBERS))
    assert not failures, failures
    return found


def rows() -> Iterator[tuple[str, ...]]:
    """A row for each scene, effect and number; time is that without the effect over that with everything."""
    for scene, campaign in SCENES.items():
        for each in influences_of(campaign):
            change = with_error(each.change, each.uncertainty) if math.isfinite(each.change) else "–"
            shown = re.sub("^-", "−", change) if each.change else "0"  # a hyphen first is a formula to a spreadsheet
            yield scene, each.effect, each.variable, shown, f"{each.seconds:.2g}"


if __name__ == "__main__":
    show([HEADER, *rows()], Path(__file__).with_name("scenes.csv"))
