"""Tables of sizes quote the dataset: an exponent where a power law holds over a decade, and nowhere else."""

from solver.sliding.distributions.events import DISCRETE
from study.figures.further.chains import names, numbers_of
from study.figures.further.sizes import LEAST_DECADES, PANELS, SHARES, claims, draw
from tests.study.figures.shipped_small import small

CAMPAIGN = "figures/chain"


def test_every_size_is_drawn_of_every_case() -> None:
    figure = draw(small(CAMPAIGN))
    assert list(PANELS) == list(DISCRETE)
    drawn = [axes for axes in figure.axes if axes.get_visible()]
    assert len(drawn) == len(PANELS)
    assert all(len(axes.lines) >= len(names(small(CAMPAIGN))) for axes in drawn)


def test_an_exponent_is_stated_where_a_decade_supports_it() -> None:
    """Also of a dataset in which one size has a range of two decades and another of none, as here they are given."""
    dataset = small(CAMPAIGN).copy()
    dataset["slips_scaling_decades"] = dataset["slips_scaling_decades"] * 0.0 + 2.0
    dataset["slips_scaling_exponent"] = dataset["slips_scaling_exponent"].fillna(0.0) * 0.0 + 1.25
    dataset["slips_scaling_exponent_uncertainty"] = dataset["slips_scaling_exponent"] * 0.0 + 0.03
    dataset["drop_scaling_decades"] = dataset["drop_scaling_decades"] * 0.0
    rows = {claim.meaning: claim for claim in claims(dataset)}
    assert len(rows) == len(names(dataset)) * len(PANELS) + len(SHARES)
    assert rows["slab: slips"].found.startswith("1.25 ± 0.03 from ")
    assert rows["slab: drop"].found == "no power law"
    for number, name in names(dataset).items():
        for size in PANELS:
            decades = float(numbers_of(dataset, number)[f"{size}_scaling_decades"])
            assert ("±" in rows[f"{name.replace('$', '')}: {size}"].found) == (decades >= LEAST_DECADES)


def test_shares_are_percentages_of_the_slab_and_each_chain() -> None:
    rows = {claim.meaning: claim for claim in claims(small(CAMPAIGN))}
    for meaning in SHARES:
        texts = [rows[meaning].found, *rows[meaning].remark.split("; ")]
        shares = [float(text.rpartition(": ")[2].removesuffix(" %")) for text in texts]
        assert len(shares) == 5
        assert all(0.0 <= share <= 100.0 for share in shares)
    few, many = (float(rows[meaning].found.split()[1]) for meaning in list(SHARES)[1:3])
    assert many > few  # events of half of the contact hold more than their share of slips
