"""`nanoslip profile`: the measured profile of a surface, what is known of its roughness, and the nodes that resolve it."""

import math
from pathlib import Path
from typing import Final

import click

from nanoslip.solver.contact.pin import Pin
from nanoslip.solver.outcome import InvalidInput, quoted
from nanoslip.solver.sliding.validity import MISSED
from nanoslip.study.commands.plans import counted
from nanoslip.study.commands.words import Refusal
from nanoslip.study.figures.shared import column, format_of, image
from nanoslip.study.manifest.checker import read_text
from nanoslip.study.manifest.surface import NamedSurface, Surface, read_surface
from nanoslip.study.manifest.units import compact, plain, stated_length
from nanoslip.study.report.console import console, print_sentences, say, whole
from nanoslip.study.report.curves import MARGIN, WIDTH, text_plot
from nanoslip.study.results.store import write_files


def show_profile(file: Path, x: str, z: str, detrend: str, width: str, picture: Path | None) -> None:
    """Print what is known of a profile, and draw it."""
    try:
        slab_width = float(plain(width, stated_length()))
    except ValueError:
        slab_width = math.nan
    if not 0.0 < slab_width < math.inf:
        raise Refusal(f'--width = {quoted(width)}: needs a length above 0, as "1 mm"')
    try:
        found = read_surface(file, read_text(file)[1], NamedSurface(str(file), x, z, detrend))  # type: ignore[arg-type]
    except InvalidInput as error:
        raise Refusal(f"{file}: {error}") from None
    print_sentences(_lines(found, slab_width))
    if picture:
        write_files({picture: _drawn(found, format_of(picture))})
        say(whole(f"written: {picture}"))
        return
    width_of_text = min(WIDTH, console().width - MARGIN)
    click.echo(text_plot(1e6 * found.x, 1e9 * found.height, ("x, in μm", "height, in nm"), width_of_text))


def pin_of(found: Surface, slab_width: float) -> Pin:
    """Its roughness on a flat pin; slab_width: in m."""
    return Pin(0.0, math.inf, found.x / slab_width, found.height / slab_width)


def nodes_for(pin: Pin) -> int | None:
    """The smallest n_x = 2^N + 1 of which nodes see enough of a rough pin's slope; None if none does."""
    for power in range(2, MOST_NODES + 1):
        slope, missed = pin.roughness_slopes(0.5**power)
        if missed <= MISSED * slope:
            return int(2**power + 1)
    return None


MOST_NODES: Final = 20
"""Power of two of the most nodes that a slab may have, less one."""


def _lines(found: Surface, slab_width: float) -> list[str]:
    length, count = float(found.x[-1] - found.x[0]), len(found.x)
    pin = pin_of(found, slab_width)
    slope, _ = pin.roughness_slopes(1.0)
    nodes, apart = nodes_for(pin), compact(length / (count - 1), "m")
    correlated = found.correlation_length
    longer = "longer than the profile" if math.isnan(correlated) else compact(correlated, "m")
    slab = f"on a slab of L_x = {compact(slab_width, 'm')}"
    resolved = f"{slab} no number of nodes resolves it: take a smaller one"
    if nodes:
        resolved = f"{slab} n_x = {nodes} resolves it, with nodes {compact(slab_width / (nodes - 1), 'm')} apart"
    return [
        f"{count} points over {compact(length, 'm')}, {apart} apart; numbers are separated by {found.separator}, "
        f"below {counted(found.skipped, 'line')}",
        f"root mean square height {compact(found.rms_height, 'm')}, slope {slope:.3g}; correlation length {longer}",
        resolved,
    ]


def _drawn(found: Surface, form: str) -> bytes:
    """The profile above its spectrum."""
    wavenumber, power = found.spectrum
    with column(4.4) as figure:
        above, below = figure.subplots(2)
        above.plot(1e6 * found.x, 1e9 * found.height)
        above.set(xlabel="x (μm)", ylabel="height (nm)")
        below.plot(wavenumber, power)
        below.set(xlabel="wavenumber 2π/λ (1/m)", ylabel="power of heights (m³)", xscale="log", yscale="log")
        return image(figure, form)
