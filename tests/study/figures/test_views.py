"""A dataset gets the views that its shape calls for; lines are thinned, and places are spread evenly."""

import csv
import io
import itertools
from collections import Counter
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import xarray as xr

import nanoslip
from nanoslip.solver.view import with_error
from nanoslip.study.dataset.variables import describe
from nanoslip.study.figures.answer import differs, make_view, words_of_alike
from nanoslip.study.figures.points import read_points
from nanoslip.study.figures.shared import View, format_csv, image, spread
from nanoslip.study.figures.views import SORTS, half_plane, size_columns, thin_line
from nanoslip.study.report.summary import scalar_table
from tests.study.figures.cases import listed, product

PLATEAU = describe("plateau_mean").meaning

# What is shown of many is spread over all axes, each value of an axis as often as the others.

AXES = {"friction": [0.25, 0.5, 1.0], "radius": [50, 100, 200, 400], "aspect": [0.5, 1.0], "support": ["b", "r"]}
PRODUCT = [dict(zip(AXES, values, strict=True)) for values in itertools.product(*AXES.values())]


@pytest.mark.parametrize("most", [4, 6, 12, 24])
def test_every_value_of_every_axis_is_shown_as_often_as_the_others(most: int) -> None:
    chosen = [PRODUCT[position] for position in spread(PRODUCT, most)]
    for name, values in AXES.items():
        counts = Counter(place[name] for place in chosen)
        assert len(counts) == min(len(values), most), name
        assert max(counts.values()) - min(counts.values()) <= 1, name


def test_pairs_of_axes_are_mixed() -> None:
    """Of 12 pairs of friction and radius 8 are seen, where an even stride through all places would show 3 of them or 4."""
    chosen = [PRODUCT[position] for position in spread(PRODUCT, 12)]
    assert len({(place["friction"], place["radius"]) for place in chosen}) >= 8
    assert len({(place["aspect"], place["support"]) for place in chosen}) == 4


def test_places_without_coordinates_lie_in_their_order() -> None:
    assert spread([{}] * 9, 3) == [1, 4, 7]


# A number that differs has a figure; one that does not is said in a sentence, with the cases that have it.

NAN = np.nan


def said(values: list[float]) -> tuple[bool, list[str]]:
    """Whether the plateaus of some radii differ, and what is said of them where they do not."""
    radii = [float(number) for number in range(1, len(values) + 1)]
    table = dict(zip(radii, values, strict=True))
    data = product(lambda radius: np.vectorize(table.get)(radius).astype(float), radius=radii)
    points = read_points(data, "plateau_mean")
    return differs(points), list(words_of_alike([points]))


def test_what_differs_is_drawn() -> None:
    assert said([0.1, 0.2, 0.2])[0]
    assert not said([0.1, 0.1, NAN])[0]
    assert not said([0.1, 0.1 + 1e-12])[0]


def test_what_does_not_differ_is_said_with_the_cases_that_have_it() -> None:
    assert said([0.25]) == (False, [f"{PLATEAU}: 0.250 ± 0.003."])
    assert said([0.25, 0.25])[1] == [f"{PLATEAU}: 0.250 ± 0.003 in all cases."]
    (text,) = said([0.25, NAN, 0.25])[1]
    assert (text.startswith(f"{PLATEAU}: 0.250 ± 0.003 in all"), text.endswith("2 of 3.")) == (True, True)
    (text,) = said([NAN, 0.25, NAN])[1]
    assert text.startswith(f"{PLATEAU}: 0.250 ± 0.003 at R/L_x = 2, the only")


def test_values_to_be_taken_with_care_are_said_to_be() -> None:
    """A contact of one node is as wide from every start: ± 0 says nothing of its grid, the flag does."""
    data = product(lambda radius: np.where(radius < 3.0, 0.25, NAN), radius=[1.0, 2.0, 3.0])
    for flags, care in (
        ([0, 0, 1], ""),
        ([1, 0, 1], "; 1 of them to be taken with care"),
        ([1, 1, 0], "; to be taken with care"),
    ):
        data["validity_flags"].values[:] = flags
        (text,) = words_of_alike([read_points(data, "plateau_mean")])
        assert text.endswith(f", 2 of 3{care}.")


def test_what_no_case_has_is_named_together() -> None:
    data = product(lambda radius: NAN * radius, radius=[1.0, 2.0])
    data["peak_friction"] = data.plateau_mean
    points = [read_points(data, name) for name in ("plateau_mean", "peak_friction", "outcome")]
    assert not any(map(differs, points))
    same, unknown = words_of_alike(points)
    assert "no_plateau" in same
    assert all(describe(name).meaning in unknown for name in ("plateau_mean", "peak_friction"))


# Thinned lines look as they did: extremes stay.


def test_a_thinned_line_keeps_ends_extremes_and_order() -> None:
    x = np.linspace(0.0, 1.0, 20_001)
    y = np.sin(40.0 * x)
    y[12_345] = 7.0
    kept = thin_line(x, y)
    assert len(kept) <= 602
    assert np.all(np.diff(kept) > 0)
    assert {0, 12_345, 20_000} <= set(kept.tolist())
    fine = np.interp(x, x[kept], y[kept])
    assert np.abs(fine - y)[:12_000].max() < 40.0 / 300  # the slope over the width of a bin


def test_a_short_line_stays_whole_and_a_drop_keeps_both_sides() -> None:
    assert thin_line(np.array([0.0, 0.5, 0.5, 1.0]), np.array([0.0, 1.0, 0.2, 0.7])).tolist() == [0, 1, 2, 3]
    assert thin_line(np.zeros(1000), np.arange(1000.0)).tolist()[::1][-1] == 999


# A dataset gets the views that its shape calls for, and no others; each names what it shows and holds its numbers.

SVG_AT_MOST = 300_000


def campaign(**changes: object) -> xr.Dataset:
    return nanoslip.run({
        "title": "Small",
        "numerics": {"n_x": 17},
        "limits": {"events": 120},
        **changes,
    })  # fmt: skip


@pytest.fixture(scope="module")
def driven() -> xr.Dataset:
    """Two records, each with two drives."""
    return campaign(
        axes={"intrinsic_friction": [0.25, 0.5]},
        drives=[{"name": "slow", "samples": 900}],
        drive_axes={"spring_stiffness": [1e5, 4e5]},
    )


@pytest.fixture(scope="module")
def pressed() -> xr.Dataset:
    """Two contacts with the inside of their slabs."""
    return campaign(stages=["contact"], axes={"radius": [50.0, 100.0]}, outputs={"subsurface": True, "tractions": True})


def views(dataset: xr.Dataset) -> dict[str, View]:
    return {view.name: view for sort in SORTS.values() for view in sort.of(dataset) if isinstance(view, View)}


@pytest.mark.slow
def test_a_driven_campaign_is_answered_and_shows_drives_and_records(driven: xr.Dataset) -> None:
    found = views(driven)
    together = {"drives_together", "records_together"}
    answers = {
        "plateau_mean_over_intrinsic_friction",
        "static_friction_over_intrinsic_friction",
        "kinetic_friction_over_intrinsic_friction",
        "mean_step",
    }
    assert together | answers <= set(found)
    assert set(found["drives_together"].columns()["case"].tolist()) == {
        f"μ_i = {friction}, k = {stiffness} kN/m" for friction in (0.25, 0.5) for stiffness in (100, 400)
    }
    assert all("member: all." in found[name].caption for name in together)
    assert set(views(driven.isel(intrinsic_friction=[0], spring_stiffness=[0]))) & {"drives_1", "records_1"}


def test_a_pressed_campaign_shows_contacts_and_the_inside(pressed: xr.Dataset) -> None:
    """Pressures share a figure, maps of the inside cannot."""
    assert set(views(pressed)) == {
        "contact_half_width", "maximum_pressure", "approach", "contacts_together", "interior_1", "interior_2",
    }  # fmt: skip


def test_of_many_runs_a_few_are_drawn_and_counted(driven: xr.Dataset, pressed: xr.Dataset, monkeypatch) -> None:
    monkeypatch.setattr("nanoslip.study.figures.views.MOST_RUNS", 2)
    caption = views(driven)["drives_together"].caption
    assert "member: 2 of 4, " in caption
    monkeypatch.setattr("nanoslip.study.figures.views.MOST_RUNS", 1)
    found = list(SORTS["interior"].of(pressed))
    assert [each for each in found if isinstance(each, str)] == ["Drawn: 1 of 2, spread over all axes."]


@pytest.mark.slow
def test_every_picture_is_small_and_its_table_is_whole(driven: xr.Dataset, pressed: xr.Dataset) -> None:
    for dataset in (driven, pressed):
        for name, view in views(dataset).items():
            assert len(image(view.draw(), "svg")) < SVG_AT_MOST, name
            lines = list(csv.reader(io.StringIO(format_csv(view.columns()))))
            assert len(lines) > 1, name
            assert set(map(len, lines)) == {len(lines[0])}, name
            assert view.caption.endswith("."), name


def test_a_drive_is_drawn_with_the_closed_form_that_was_fitted(driven: xr.Dataset) -> None:
    table = views(driven.isel(intrinsic_friction=[0], spring_stiffness=[0]))["drives_1"].columns()
    assert len(table["time"]) < 900
    missed = table["spring_force"] - table["fitted_spring_force"]
    residual = float(driven.fit_residual.values.ravel()[0])
    assert np.sqrt(np.mean(missed**2)) < 3.0 * residual + 0.01  # thinned: the extremes are kept, the residual is of all


def test_pressures_stand_beside_those_of_a_half_plane(pressed: xr.Dataset) -> None:
    table = views(pressed.isel(radius=[0]))["contacts_1"].columns()
    spacing = np.diff(table["x"])[0]
    for name in ("pressure", "half_plane_pressure"):
        assert np.sum(table[name]) * spacing == pytest.approx(1.0, rel=0.1), name  # W, on 17 nodes


def test_a_scheme_that_is_none_has_no_pressure_of_a_half_plane() -> None:
    """As in a dataset that somebody changed: its page was a traceback."""
    case = xr.Dataset({"scheme": "<<<<", "pin": "parabola"})
    assert np.isnan(half_plane(case, np.linspace(-0.1, 0.1, 5))).all()


def test_a_punch_stands_beside_the_pressure_that_it_has_on_a_half_plane() -> None:
    """Of the load W in all, least in the middle: 1/(pi·a) of a punch of half-width a; none beside it."""
    punch = xr.Dataset(coords={"pin": "flat_punch", "half_width": 0.1})
    x = 0.1 * np.sin(np.linspace(-0.5, 0.5, 2001)[1:-1] * np.pi)  # finer towards the ends, where it is infinite
    pressure = half_plane(punch, x)
    assert np.trapezoid(pressure, x) == pytest.approx(1.0, rel=1e-3)
    assert pressure.min() == pytest.approx(1.0 / (0.1 * np.pi), rel=1e-12)
    assert not half_plane(punch, np.array([-0.2, 0.11])).any()


def test_the_inside_is_drawn_by_its_largest_shear_stress(pressed: xr.Dataset) -> None:
    table = views(pressed)["interior_1"].columns()
    xx, zz, xz = (table[f"stress_{name}"] for name in ("xx", "zz", "xz"))
    stresses = np.linalg.eigvalsh(np.stack([np.stack([xx, xz], -1), np.stack([xz, zz], -1)], -1))
    np.testing.assert_allclose(table["largest_shear_stress"], 0.5 * (stresses[:, 1] - stresses[:, 0]), atol=1e-12)


def test_a_single_case_without_records_calls_for_nothing() -> None:
    assert views(product(intrinsic_friction=[0.5])) == {}


def test_what_is_not_drawn_and_what_has_no_value_is_said() -> None:
    values = [float(number) for number in range(1, 8)]
    data = product(
        lambda intrinsic_friction, radius, normal_load, aspect_ratio: np.where(radius == 1.0, np.nan, normal_load),
        intrinsic_friction=values, radius=values[:6], normal_load=values[:5], aspect_ratio=values[:5],
    )  # fmt: skip
    caption = views(data)["plateau_mean_over_intrinsic_friction"].caption
    assert "drawn for L_z/L_x = 3 only" in caption
    assert "crosses: 35 without" in caption  # of those that are drawn


def test_a_list_of_cases_is_drawn_against_each_of_its_columns() -> None:
    data = listed({"radius": [50.0, 200.0, 100.0], "n_x": [17, 33, 65]}, [0.1, 0.2, 0.3])
    data["mean_step"] = data.plateau_mean
    assert views(data)["mean_step"].caption.endswith("against R/L_x and n_x.")


def test_a_list_of_axes_that_vary_together_is_drawn_once_and_says_so() -> None:
    manifest = 'design = "zip"\n[axes]\nradius = [50.0, 200.0, 100.0]\nnormal_load = [1e-3, 1e-4, 5e-4]\n'
    data = listed({"radius": [50.0, 200.0, 100.0], "normal_load": [1e-3, 1e-4, 5e-4]}, [0.1, 0.2, 0.3], manifest)
    found = make_view(read_points(data, "plateau_mean"))
    assert "against R/L_x. R/L_x and W/(G·L_x·L_y) vary together." in found.caption
    assert len(found.draw().axes) == 1
    assert {"radius", "normal_load"} <= set(found.columns())
    other = make_view(read_points(data, "plateau_mean"), "normal_load")
    assert "against W/(G·L_x·L_y). R/L_x and" in other.caption


def test_signs_that_would_hide_a_crowded_map_are_a_line_around_what_is_to_be_taken_with_care() -> None:
    data = product(
        lambda radius, intrinsic_friction: np.where(radius > 70.0, np.nan, intrinsic_friction),
        intrinsic_friction=np.linspace(0.1, 1.0, 40).tolist(),
        radius=np.linspace(1.0, 80.0, 80).tolist(),
    )
    flags = data["validity_flags"]
    flags[:20] = 1
    found = make_view(read_points(data, "plateau_mean"))
    assert "White: 400 without a value. 1400 of 3200, hatched" in found.caption
    axes = found.draw().axes[0]
    assert not axes.lines
    (hatched,) = axes.collections[1].get_paths()
    frictions, radii = data["intrinsic_friction"].values, data["radius"].values
    # As far as halfway to the next ones, which have no flag or no value.
    np.testing.assert_allclose(hatched.vertices.min(axis=0), [radii[0], frictions[0]])
    np.testing.assert_allclose(hatched.vertices.max(axis=0), [radii[69:71].mean(), frictions[19:21].mean()])
    flags[:] = 1
    assert "All are" in make_view(read_points(data, "plateau_mean")).caption


def test_signs_are_explained_where_they_are_drawn() -> None:
    data = product(lambda radius, n_x: 0.1 * radius, radius=[1.0, 2.0, 3.0], n_x=[17, 33])
    data["validity_flags"][0, 0] = 1
    assert "Bars: its uncertainty" in make_view(read_points(data, "plateau_mean")).caption
    for name, sign in (("plateau_mean", "Hollow"), ("outcome", "Dots")):
        assert f"{sign}: " in make_view(read_points(data, name)).caption
    alone = data.isel(n_x=0)
    assert "Hollow: " in make_view(read_points(alone, "outcome")).caption
    assert "care" not in make_view(read_points(data.isel(n_x=1), "outcome")).caption


def test_a_table_is_read_back_as_it_was() -> None:
    text = format_csv({"name": np.array(["a, b", "c"], dtype=object), "value": np.array([1.0 / 3.0, np.nan])})
    assert text == 'name,value\n"a, b",0.333333333\nc,\n'


@pytest.mark.parametrize("formula", ["=1+1", "+cmd", "-cmd", "@sum", "-2+3"])
def test_no_text_of_a_table_is_a_formula_and_numbers_stay_numbers(formula) -> None:
    text = format_csv({formula: np.array([formula, "-0.5"], dtype=object), "value": np.array([-1.5, -1e-300])})
    assert text == f"'{formula},value\n'{formula},-1.5\n-0.5,-1e-300\n"


def test_runs_without_anything_in_them_are_said_and_not_drawn() -> None:
    """Records that are given up at their first event."""
    data = campaign(
        stages=["contact", "slip"],
        axes={"intrinsic_friction": [0.25], "poisson": [0.2, 0.3]},
        numerics={"n_x": 33},
        slip={"cascade_limit": 1},
    )
    assert not data.events.any()
    assert {name for name in views(data) if name.startswith(("records", "sizes"))} == set()
    (text,) = (each for each in SORTS["records"].of(data) if isinstance(each, str))
    assert text.startswith("None of 2")


def test_sizes_of_few_events_are_said_and_not_drawn() -> None:
    data = campaign(
        stages=["contact", "slip"],
        axes={"intrinsic_friction": [0.25, 0.5]},
        limits={"events": 12},
        outputs={"statistics": True},
        ensemble={"members": 1},
    )
    assert "sizes_together" not in views(data)
    assert "first member" not in views(data)["records_together"].caption
    (text,) = (each for each in SORTS["sizes"].of(data) if isinstance(each, str))
    assert (text.startswith("None of 2"), "fewer than 50" in text) == (True, True)


@pytest.mark.slow
def test_sizes_show_the_power_law_of_the_largest_unless_it_is_refused() -> None:
    """From the cut-off on the law has as many events as all members have; table, answer and figure say its exponent with ±."""
    data = campaign(
        stages=["contact", "slip"],
        axes={"start": [0.1, 0.6]},
        numerics={"n_x": 33},
        limits={"events": 600},
        outputs={"statistics": True},
        ensemble={"members": 3},
    )
    data["slips_goodness"].values.flat[:] = 0.05, 0.5  # one is refused, whatever chance drew
    view = views(data)["sizes_together"]
    assert "first member" not in view.caption
    text = image(view.draw(), "svg").decode()
    table = view.columns()
    refused, kept = dict.fromkeys(table["case"].tolist())
    exponent, uncertainty, cutoff, events = (
        float(data[name].values.flat[1])
        for name in ("slips_exponent", "slips_exponent_uncertainty", "slips_cutoff", "sized_events")
    )
    here = {name: values[table["case"] == kept] for name, values in table.items()}
    inside = np.isfinite(here["power_law"])
    np.testing.assert_array_equal(inside, here["event_slips"] >= cutoff)
    assert 0.7 < np.median(here["power_law"][inside] / here["density"][inside]) < 1.4
    assert 600 < here["events"].sum() <= events  # a release or a touch has no slips
    assert uncertainty > 0.0
    assert f"{kept}: τ = {with_error(exponent, uncertainty)}" in text
    assert np.isnan(table["power_law"][table["case"] == refused]).all()
    assert f"{refused}: τ" not in text
    assert {"τ of slips", "goodness of τ"} <= set(scalar_table(data).header)
    assert {"slips_exponent", "slips_goodness"} <= set(views(data))


def test_a_contact_of_very_many_nodes_is_thinned_to_what_can_be_seen() -> None:
    """Without a matrix contacts have a hundred thousand nodes: a page would take 40 MB."""
    found = campaign(
        stages=["contact"],
        numerics={"n_x": 20_001, "scheme": "half_plane"},
        effects={"coupling": False},
        outputs={"tractions": True},
    )
    view = views(found)["contacts_1"]
    columns = view.columns()
    assert len(columns["x"]) <= 1200
    assert columns["pressure"].max() == found.nanoslip.contact()["pressure"].values.max()
    assert len(image(view.draw(), "svg")) < SVG_AT_MOST


def test_the_power_law_of_slips_is_drawn_over_the_share_of_events_in_its_tail(monkeypatch: pytest.MonkeyPatch) -> None:
    """Over single sizes it adds up to that share; below the cut-off it is not drawn."""
    sizes = np.arange(1.0, 5001.0)
    fit = {"exponent": 2.5, "exponent_uncertainty": 0.1, "goodness": 0.5, "cutoff": 5.0, "tail": 300.0}
    bins = {"bin_middle": sizes, "bin_events": np.full(5000, 0.2), "bin_density": sizes}
    columns = {name: ("bin", each) for name, each in bins.items()}
    found = xr.Dataset(columns | {f"slips_{name}": each for name, each in fit.items()})
    accessor = SimpleNamespace(event_sizes=lambda _: found)
    monkeypatch.setattr("nanoslip.study.figures.views.Accessor", lambda _: accessor)
    run: Any = SimpleNamespace(selection={})
    law = size_columns(xr.Dataset(), run)["power_law"]
    assert np.nansum(law) == pytest.approx(0.3, rel=1e-3)
    np.testing.assert_array_equal(np.isnan(law), sizes < 5.0)
