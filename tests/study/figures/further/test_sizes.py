"""Tables of sizes quote the dataset: an exponent where a power law is not refused, and nowhere else."""

import numpy as np
import pytest
from chain import BROAD, PANELS, SHARES, claims, draw, names, numbers_of, steady_sizes

from nanoslip.solver.sliding.power_law import SIGNIFICANT
from nanoslip.solver.sliding.sizes import DISCRETE
from tests.study.figures.shipped_small import small

CAMPAIGN = "figures/chain"


def test_every_size_is_drawn_of_every_case() -> None:
    figure = draw(small(CAMPAIGN))
    assert list(PANELS) == list(DISCRETE)
    drawn = [axes for axes in figure.axes if axes.get_visible()]
    assert len(drawn) == len(PANELS)
    assert all(len(axes.lines) >= len(names(small(CAMPAIGN))) for axes in drawn)


def test_the_legend_names_the_cases_and_no_power_law() -> None:
    dataset = small(CAMPAIGN).copy()
    dataset["slips_goodness"] = dataset["slips_goodness"] * 0.0 + 0.5
    (legend,) = draw(dataset).legends
    assert [text.get_text() for text in legend.get_texts()] == list(names(dataset).values())


def test_an_exponent_is_stated_unless_its_power_law_is_refused() -> None:
    """Also of a dataset in which one size is a power law and another is none, as here they are given."""
    dataset = small(CAMPAIGN).copy()
    dataset["slips_goodness"] = dataset["slips_goodness"] * 0.0 + 0.5
    dataset["drop_goodness"] = dataset["drop_goodness"] * 0.0
    rows = {claim.meaning: claim for claim in claims(dataset)}
    assert len(rows) == len(names(dataset)) * len(PANELS) + len(SHARES)
    drawn = dict(zip(PANELS, draw(dataset).axes, strict=False))
    for size, axes in drawn.items():
        stated = 0
        for number, name in names(dataset).items():
            scalars, row = numbers_of(dataset, number), rows[f"{name.replace('$', '')}: {size}"]
            fitted = bool(scalars[f"{size}_goodness"] >= SIGNIFICANT)
            exponent = f"{float(scalars[f'{size}_exponent']):.3g} ± ?"  # of one start
            assert row.found == (exponent if fitted else "no power law")
            assert f"goodness {float(scalars[f'{size}_goodness']):.2g}, " in row.remark
            stated += fitted
        assert sum(line.get_linewidth() == BROAD for line in axes.lines) == stated


def test_a_broad_line_is_the_density_of_the_largest_sizes() -> None:
    """Its integral from the cut-off on is their share of all, 1 % less what lies beyond the largest of hundreds."""
    dataset = small(CAMPAIGN).copy()
    dataset["step_goodness"] = dataset["step_goodness"] * 0.0 + 0.5
    lines = [
        line for line in list(draw(dataset).axes)[list(PANELS).index("step")].lines if line.get_linewidth() == BROAD
    ]
    assert len(lines) == len(names(dataset))
    for line, number in zip(lines, names(dataset), strict=True):
        scalars, values = numbers_of(dataset, number), steady_sizes(dataset, number).step
        bins = dataset.nanoslip.event_sizes("step", case=number)
        (first, last), (high, _) = line.get_xdata(), line.get_ydata()
        exponent, tail = float(scalars["step_exponent"]), float(scalars["step_tail"])
        above = high * first / (exponent - 1.0)
        assert above == pytest.approx(tail / np.count_nonzero(values > 0.0), rel=1e-9)
        assert (first, last) == (float(scalars["step_cutoff"]), float(bins["bin_middle"][-1]))


def test_shares_are_percentages_of_the_slab_and_each_chain() -> None:
    rows = {claim.meaning: claim for claim in claims(small(CAMPAIGN))}
    for meaning in SHARES:
        texts = [rows[meaning].found, *rows[meaning].remark.split("; ")]
        shares = [float(text.rpartition(": ")[2].removesuffix(" %")) for text in texts]
        assert len(shares) == 5
        assert all(0.0 <= share <= 100.0 for share in shares)
    few, many = (float(rows[meaning].found.split()[1]) for meaning in list(SHARES)[1:3])
    assert many > few  # events of half of the contact hold more than their share of slips
