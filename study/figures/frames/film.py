"""The contact after several events as a file: a strip (PNG, PDF, SVG) or a film (GIF, MP4), as its suffix says."""

import os
from collections.abc import Iterable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg

from nanoslip.solver.case import Case
from nanoslip.solver.outcome import InvalidInput
from nanoslip.study.figures.frames.drawing import MOST_IN_STRIP, draw_frame, strip
from nanoslip.study.figures.frames.moments import Moments, events_of, moments_of
from nanoslip.study.figures.shared.canvas import FORMATS, column, format_of, image
from nanoslip.study.figures.shared.files import write_files

FILMS: Final[dict[str, Any]] = {"gif": PillowWriter, "mp4": FFMpegWriter}
"""Suffix of a film -> what writes it."""
FRAMES_PER_SECOND: Final = 5
RESOLUTION: Final = 120
"""Of films, in dots per inch."""


def frames(case: Case, events: str | Iterable[int], path: str | os.PathLike[str]) -> Moments:
    """Draw a case after each of some events into a file: pressure, shear, slip, and where in the friction record that is.

    events: numbers, 0 is initial contact; or text, as `0:200:40` or `0,5,12`. path: its suffix says whether it is a strip (.png,
    .pdf, .svg) or a film (.gif, .mp4). Returns what is drawn; events that the record does not reach are left out.
    Raises InvalidInput for events, a case or a suffix that cannot be drawn, StoreError where the file cannot be written.

    >>> import nanoslip
    >>> nanoslip.frames(nanoslip.Case(), "0:200:40", "strip.png").outcome.ok  # doctest: +SKIP
    True
    """
    wanted = events_of(events) if isinstance(events, str) else tuple(sorted(set(events)))
    suffix = _suffix(Path(path), len(wanted))
    shown = moments_of(case, wanted)
    write_files({Path(path): _film(shown, suffix) if suffix in FILMS else image(strip(shown), suffix)})
    return shown


def _suffix(path: Path, count: int) -> str:
    """The format of a file with so many pictures. Raises InvalidInput where there is none, or nothing here writes it."""
    suffix = format_of(path, (*FORMATS, *FILMS))
    if suffix in FILMS and not FILMS[suffix].isAvailable():
        raise InvalidInput(f"{path}: needs the program ffmpeg, which is not found here; install it, or take .gif")
    if suffix in FORMATS and count > MOST_IN_STRIP:
        raise InvalidInput(
            f"{path}: {count} events: a strip holds at most {MOST_IN_STRIP}; ask for fewer, or for a .gif or .mp4"
        )
    return suffix


def _film(shown: Moments, suffix: str) -> bytes:
    """The moments one after the other, on axes with the same limits."""
    writer = FILMS[suffix](fps=FRAMES_PER_SECOND)
    with TemporaryDirectory() as folder, column(3.0, 6.0) as figure:
        FigureCanvasAgg(figure)
        film = Path(folder) / f"film.{suffix}"
        with writer.saving(figure, str(film), RESOLUTION):
            for moment in shown.moments:
                figure.clear()
                draw_frame(figure, shown, moment)
                writer.grab_frame()
        return film.read_bytes()
