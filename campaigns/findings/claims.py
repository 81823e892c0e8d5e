"""Claims of docs/findings.md: bounds of numbers, which scripts beside campaigns compute from their datasets.

`python campaigns/findings/claims.py --out results` computes the campaigns and writes the table, claims.md beside this file.
`--again 1` computes them from other starts instead, to hold the same bounds; it writes no table.
"""

from nanoslip.study.run.launch import pin_arithmetic

pin_arithmetic()  # before numpy is imported: numbers of the table are the same wherever it is written

import csv
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import click
import xarray as xr

import nanoslip
from nanoslip.solver.view import with_error
from nanoslip.study.figures.gallery import execute_script, script_figures
from nanoslip.study.figures.shared import Number, table
from nanoslip.study.results.store import write_files
from nanoslip.study.shipped import campaign_files

HERE = Path(__file__).parent
HEADER = ("claim", "bounds", "found", "± over", "campaign")
HEAD = """# Claims

Each number of [what the paper's model says](../../docs/findings.md), with bounds that other starts keep, and what its ± is the
68 % interval over. `make findings` writes this table, `make findings AGAIN=1` holds the bounds against other starts. Tests
recompute each claim in a small form.
"""


class Bounds(NamedTuple):
    """One claim: bounds of a number, and the campaign and the name of the number in its script."""

    finding: str
    claim: str
    low: float
    high: float
    campaign: str
    number: str
    over: str
    """What ± is the 68 % interval over, or why there is none."""

    def hold(self, found: Number) -> bool:
        """True if a number, with its ±, lies within."""
        return self.low <= found.value - found.error and found.value + found.error <= self.high

    @property
    def words(self) -> str:
        """The bounds in words."""
        if self.low == self.high:
            return f"{self.low:g}"
        least, most = f"{self.low:g}", f"{self.high:g}"
        return (
            f"at most {most}"
            if self.low == -float("inf")
            else f"at least {least}"
            if self.high == float("inf")
            else f"{least} to {most}"
        )


def all_claims() -> tuple[Bounds, ...]:
    """The claims, in their order."""
    with (HERE / "claims.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    ends = [(float(row.pop("low") or "-inf"), float(row.pop("high") or "inf")) for row in rows]
    return tuple(Bounds(low=low, high=high, **row) for row, (low, high) in zip(rows, ends, strict=True))


def number(claim: Bounds, dataset: xr.Dataset) -> Number:
    """The number of a claim, from a dataset of its campaign."""
    found: Mapping[str, Any] = execute_script(campaign_files()[claim.campaign].with_suffix(".py"))["NUMBERS"]
    return Number(*found[claim.number](dataset))


def content_of(campaign: str, again: int = 0) -> dict[str, Any]:
    """The keys of a campaign, as `nanoslip.run` takes them. again: from other starts and nodes, otherwise the same."""
    path = campaign_files()[campaign]
    content = tomllib.loads(path.read_text("utf-8"))
    for place, key in ((content, "table"), (content.get("path", {}), "legs")):
        if key in place:
            place[key] = str(path.parent / place[key])
    if not again:
        return content
    axes = content.setdefault("axes", {}) if "table" not in content else {}
    if "start" in axes:
        axes["start"] = [(start + 0.0131 * again) % 1.0 for start in axes["start"]]
    constants = axes if "radius" in axes else content.setdefault("constants", {})
    drawn, other = constants.get("radius", 200.0), 1.0 + 1e-9 * again  # members are drawn by the radius
    constants["radius"] = [each * other for each in drawn] if isinstance(drawn, list) else drawn * other
    content["heterogeneity"] = {**content.get("heterogeneity", {}), "seed": 1 + again}
    return content


def computed(out: Path, jobs: int, again: int) -> Iterator[tuple[Bounds, Number]]:
    """Each claim with its number. Finished results are used."""
    datasets: dict[str, xr.Dataset] = {}
    for claim in all_claims():
        if claim.campaign not in datasets:
            place = out / (f"again_{again}" if again else "") / claim.campaign
            datasets[claim.campaign] = nanoslip.run(content_of(claim.campaign, again), place, jobs=jobs).load()
        yield claim, number(claim, datasets[claim.campaign])


@click.command()
@click.option(
    "--out", type=click.Path(path_type=Path), default=Path("results"), help="Folder of the campaigns' results."
)
@click.option("--jobs", type=int, default=1, help="Processes.")
@click.option("--again", type=int, default=0, help="Number of other starts; 0: the campaigns' own.")
def main(out: Path, jobs: int, again: int) -> None:
    """Compute all claims; end with 1 if one does not hold."""
    found = list(computed(out, jobs, again))
    shown = table((as_row(*each) for each in found), HEADER)
    if again:
        print(shown)
    else:
        write_files({HERE / "claims.md": f"{HEAD}\n{shown}\n".encode()})
    sys.exit("\n".join(f"does not hold: {as_row(*each)}" for each in found if not each[0].hold(each[1])) or 0)


def as_row(claim: Bounds, found: Number) -> tuple[str, ...]:
    """A row of the table, which leads to the page of its campaign's figure."""
    first, *_ = script_figures(campaign_files()[claim.campaign])
    page = f"[{claim.campaign}](../{Path(claim.campaign).parent}/{first.name}.md)"
    return f"{claim.finding}: {claim.claim}", claim.words, in_words(found), claim.over, page


def in_words(found: Number) -> str:
    """A number ± its error, without one if it is none of a mean."""
    return with_error(*found) if found.error else f"{found.value:.3g}"


if __name__ == "__main__":
    main()
