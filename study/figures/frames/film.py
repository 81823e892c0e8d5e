"""Moments as a file: a strip (PNG, PDF, SVG) or a film (GIF, MP4), as its suffix says."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from matplotlib.animation import FFMpegWriter, PillowWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg

from solver.outcome import InvalidInput
from study.figures.frames.drawing import draw_frame, strip
from study.figures.frames.moments import Moments
from study.figures.shared.canvas import FORMATS, column, image
from study.figures.shared.files import write_files

FILMS: Final[dict[str, Any]] = {"gif": PillowWriter, "mp4": FFMpegWriter}
"""Suffix of a film -> what writes it."""
FRAMES_PER_SECOND: Final = 5
RESOLUTION: Final = 120
"""Of films, in dots per inch."""


def check_suffix(path: Path) -> None:
    """Raise InvalidInput where no picture has this suffix, or where what writes it is not installed."""
    suffix = path.suffix.removeprefix(".")
    if suffix not in (*FORMATS, *FILMS):
        raise InvalidInput(f"{path}: needs one of the suffixes .{', .'.join((*FORMATS, *FILMS))}")
    if suffix in FILMS and not FILMS[suffix].isAvailable():
        raise InvalidInput(f"{path}: needs the program ffmpeg, which is not found here; install it, or take .gif")


def write_frames(shown: Moments, path: Path) -> None:
    """Write moments to a file. Raises InvalidInput as `check_suffix` and `strip` do, StoreError where it cannot be written."""
    check_suffix(path)
    suffix = path.suffix.removeprefix(".")
    write_files({path: _film(shown, suffix) if suffix in FILMS else image(strip(shown), suffix)})


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
