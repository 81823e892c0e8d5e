"""The command line with a head start for small campaigns: the third case is planned when a result of the first ones is there."""

import sys
import time
from pathlib import Path

from nanoslip import main
from study.commands.running import head_start
from study.plan.plan import Planning
from study.results.store import FOLDER

if __name__ == "__main__":
    plan_on, results = Planning.go_on, Path(sys.argv[sys.argv.index("--out") + 1]) / FOLDER

    def slowly(planning: Planning, cases: int = 1) -> bool:
        """Plan slower than tasks are computed."""
        time.sleep(0.05)
        return (planning.cases >= 2 and not any(results.glob("*.log"))) or plan_on(planning, cases)

    head_start.LARGE = 4  # type: ignore[misc]
    head_start.AT_ONCE = 1  # type: ignore[misc]
    Planning.go_on = slowly  # type: ignore[method-assign]
    main()
