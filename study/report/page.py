"""Draw a dataset's figures and write one HTML page with all of them inside."""

import base64
import io
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import jinja2
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from study.dataset.access.accessor import Accessor
from study.dataset.groups import groups_of
from study.dataset.store import StoreError, written_whole
from study.manifest.parameters import Value
from study.report.summary import Point, flag_summary, points, scalar_table, words

FILE: Final = "report.html"
FOLDER: Final = "figures"
MOST_FIGURES: Final = 40
"""The most figures of each sort (records, drives) that a report draws."""


@dataclass(frozen=True, slots=True)
class Picture:
    """One figure: stem of its file name, caption, and image as PNG."""

    name: str
    caption: str
    png: bytes

    @property
    def base64(self) -> str:
        """The image in base64, to stand inside the page."""
        return base64.b64encode(self.png).decode()


def pictures(dataset: xr.Dataset) -> Iterator[Picture]:
    """The figures of a dataset: F/W against δ_p of each record, then the spring force of each drive over time.

    Where there are 2 to 8 of a sort, a figure with all of them comes first."""
    for instance, sample, draw, caption in (
        ("record", "event", _draw_record, "Friction force over load against pin displacement"),
        ("trajectory", "sample", _draw_trajectory, "Spring force over load against time"),
    ):
        if f"{instance}_id" not in dataset or sample not in groups_of(dataset).get(instance, xr.Dataset()).dims:
            continue
        found = [point for point in points(dataset, f"{instance}_id") if point.values[f"{instance}_id"] != ""]
        if 2 <= len(found) <= 8:
            yield _picture(dataset, found, draw, f"{instance}_all", f"{caption}, all cases")
        for point in found[:MOST_FIGURES]:
            name = "_".join([instance, str(point.values["case_id"].item()), *_file_word(point.label.get("drive"))])
            yield _picture(dataset, [point], draw, name, f"{caption}: {words(point.label)}".rstrip(": "))


def write(dataset: xr.Dataset, out: Path) -> list[Path]:
    """Write the page and its figures into a folder. Returns their paths, the page first. Raises StoreError."""
    found = list(pictures(dataset))
    page = out / FILE
    figures = [out / FOLDER / f"{picture.name}.png" for picture in found]
    try:
        (out / FOLDER).mkdir(parents=True, exist_ok=True)
        for picture, figure in zip(found, figures, strict=True):
            with written_whole(figure) as scratch:
                scratch.write_bytes(picture.png)
        with written_whole(page) as scratch:
            scratch.write_text(_page(dataset, found), "utf-8")
    except OSError as error:
        raise StoreError(f"{out}: cannot write the report there: {error.strerror or error}") from None
    return [page, *figures]


def _picture(dataset: xr.Dataset, shown: list[Point], draw: Any, name: str, caption: str) -> Picture:
    figure = Figure(figsize=(7.0, 4.2), layout="constrained")
    canvas = FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    for point in shown:
        draw(axes, dataset, point)
    axes.grid(alpha=0.3)
    if any(point.label for point in shown):
        axes.legend()
    buffer = io.BytesIO()
    canvas.print_figure(buffer, dpi=130, format="png", metadata={"Software": None})
    return Picture(name, caption, buffer.getvalue())


def _draw_record(axes: Any, dataset: xr.Dataset, point: Point) -> None:
    line = Accessor(dataset).teeth(**point.selection)
    axes.plot(line["displacement"], line["friction_force"], linewidth=0.7, label=words(point.label))
    axes.set(xlabel="pin displacement δ_p/L_x", ylabel="friction force F/W")


def _draw_trajectory(axes: Any, dataset: xr.Dataset, point: Point) -> None:
    run = Accessor(dataset).trajectory(**point.selection)
    axes.plot(1e3 * run["time"].values, run["sample_spring_force"].values, linewidth=1.0, label=words(point.label))
    axes.set(xlabel="time (ms)", ylabel="spring force over load")


def _file_word(drive: Value | None) -> list[str]:
    return [] if drive is None else ["".join(letter if letter.isalnum() else "-" for letter in str(drive))]


def _page(dataset: xr.Dataset, found: list[Picture]) -> str:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("study.report"), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )
    elsewhere = ("title", "manifest", "manifest_front")  # shown above, or too long to be
    attributes = {name: value for name, value in dataset.attrs.items() if name not in elsewhere}
    return environment.get_template("report.html.j2").render(
        title=dataset.attrs["title"],
        manifest=dataset.attrs.get("manifest", ""),
        attributes=attributes,
        table=scalar_table(dataset),
        flags=flag_summary(dataset),
        pictures=found,
    )
