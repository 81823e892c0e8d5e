"""A measured profile is read as it was written, in its units, and its numbers are those of the surface it was made of."""

import io
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from nanoslip.solver.case import make_image
from nanoslip.solver.contact.pin import roughness_slopes
from nanoslip.solver.outcome import InvalidInput
from nanoslip.solver.sliding.validity import resolving_nodes
from nanoslip.study import api
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.problems import ManifestError
from nanoslip.study.manifest.reader import load_manifest, parse_manifest
from nanoslip.study.manifest.surface import Detrend, NamedSurface, Surface, read_surface
from nanoslip.study.measured.columns import decode_text
from tests.conftest import Main
from tests.study.manifest.problems import lines_of

AFM = Path("afm.txt")
IN_NANOMETRES = NamedSurface("afm.txt", "nm", "nm", "none")
TEXTS = {
    "commas": "x,z\n0,1.5\n50,2\n100,1\n",
    "semicolons": "Messung 3\n\nx;z\n0;1,5\n50;2\n100;1e0\n",
    "tabs": "# channel 1\n# nm\tnm\n0\t1.5\t7\n50\t2\t7\n# rescan\n100\t1\t7\n",
    "spaces": "  0   1.5\n  50  +2.\n\n 100  1\n",
    "commas within quotes": 'x,z\n"0","1,5"\n"50","2"\n"100","1"\n',
    "commas, and decimal ones": "0, 1,5\n50, 2,0\n100, 1\n",
    "tabs, and decimal commas": "0,0\t1,5\n50\t2\n1e2\t1\n",
    "commas from right to left": "100,1\n50,2\n0,1.5\n",
}


@pytest.mark.parametrize("kind", TEXTS)
def test_columns_are_read_whatever_separates_them_and_stands_above(kind: str) -> None:
    found = read_surface(AFM, TEXTS[kind], IN_NANOMETRES)
    assert found.source
    assert found.source.separator == kind.split(maxsplit=1)[0].rstrip(",")
    np.testing.assert_allclose(found.x, [-50e-9, 0.0, 50e-9], atol=1e-22)
    np.testing.assert_allclose(found.height, [1.5e-9, 2e-9, 1e-9], rtol=1e-12)


@pytest.mark.parametrize(("detrend", "degree"), [("mean", 0), ("line", 1), ("parabola", 2)])
def test_what_is_taken_off_is_a_polynomial_and_nothing_else(detrend: str, degree: int) -> None:
    x = np.linspace(0.0, 10.0, 201)
    wave = np.cos(2.0 * np.pi * x)
    trend = np.polynomial.Polynomial([3.0, -0.7, 0.2][: degree + 1])(x)
    text = "\n".join(f"{at!r},{height!r}" for at, height in zip(x.tolist(), (wave + trend).tolist(), strict=True))
    found = read_surface(AFM, text, NamedSurface("a", "um", "nm", detrend))  # type: ignore[arg-type]
    np.testing.assert_allclose(found.height, 1e-9 * wave, atol=0.05e-9)  # ten whole waves are nearly free of a parabola


def test_roughness_is_that_of_the_waves_it_is_made_of() -> None:
    k, amplitude = 2.0 * np.pi / 1e-6, 3e-9
    x = np.linspace(-20e-6, 20e-6, 8001)
    found = Surface(x, amplitude * np.cos(k * x))
    assert found.rms_height == pytest.approx(amplitude / np.sqrt(2.0), rel=1e-3)
    assert roughness_slopes(found.image(1e-3), 1.0)[0] == pytest.approx(k * amplitude / np.sqrt(2.0), rel=1e-3)
    assert found.correlation_length == pytest.approx(np.arccos(1.0 / math.e) / k, abs=x[1] - x[0])
    wavenumber, power = found.spectrum
    assert wavenumber[power.argmax()] == pytest.approx(k, rel=0.01)
    assert power.sum() * (wavenumber[1] - wavenumber[0]) == pytest.approx(found.rms_height**2, rel=1e-3)  # Parseval
    # Straight lines a spacing apart miss k·spacing/√12 of the slope of short waves; half of it near a quarter of a wave.
    nodes = resolving_nodes(found.image(40e-6))
    assert nodes is not None
    assert 2.0 < 1e-6 / (40e-6 / (nodes - 1)) < 8.0


def test_a_campaign_takes_it_in_its_units() -> None:
    rough = '{file = "afm.txt", x = "nm", z = "nm", detrend = "none"}'
    text = f'title = "x"\nheterogeneity.roughness = {rough}\nscales.slab_width = "1 um"'
    manifest = parse_manifest(Path("mine.toml"), text, {"roughness": TEXTS["tabs"]})
    (case,) = expand(manifest)
    assert case.case
    points = np.array(case.case.heterogeneity.roughness)
    np.testing.assert_allclose(points, [[-0.05, 1.5e-3], [0.0, 2e-3], [0.05, 1e-3]], rtol=1e-12, atol=1e-18)
    assert manifest.files == {"roughness": TEXTS["tabs"]}


def test_python_reads_the_file_that_a_dict_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    AFM.write_text("\n".join(f"{place} {place % 7}" for place in range(0, 900_000, 9_000)))
    rough = {"roughness": {"file": "afm.txt", "x": "nm", "z": "nm"}}
    small = {"limits": {"events": 3}, "ensemble": {"members": 1}, "numerics": {"n_x": 65}}
    data = api.run({"title": "x", "heterogeneity": rough, **small}, progress=False)
    assert data.attrs["manifest_roughness"] == AFM.read_text()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "number of points = 0: needs at least 2 lines of two numbers in afm.txt"),
        ("0 1\n", "number of points = 1: needs at least 2 lines"),
        (
            "no number\n0 1\n",
            "number of points = 1: needs at least 2 lines of two numbers in afm.txt; line 2 is '0 1'",
        ),
        ("0 1\na\nb\nc\n2 3\n", "line 2: 'a': needs 2 columns of numbers, as line 1"),
        ("a,b,c,d\n0,1,2,3\n1,1,2,3\n", "columns 1 a, 2 b, 3 c, 4 d: needs two columns, or the names x and z"),
        ("a,b\n0,0,1,5\n0,5,1,5\n", "2 names above 4 columns: are there decimal commas?"),
        ("x [um],z [um]\n0,1\n1,1\n", "x = 'nm': the header has x in um"),
        ("0 1\n1 1e16\n2 3\n", "line 2: x = 1, height = 1e\\+16: needs both within 1000 km"),
        ("0 1\n1e-6 2\n2 3\n", "line 2: x = 1e-06 after 0: needs x that goes one way, by 1e-12 m at least"),
        ("0 1\n2 1\n1 3\n4 4\n", "line 3: x = 1 after 2: needs x that goes one way"),
        ("0 1\n0 1\n", "x = 0 in all lines"),
    ],
)
def test_a_wrong_line_is_named(text: str, said: str) -> None:
    with pytest.raises(InvalidInput, match=said):
        read_surface(AFM, text, IN_NANOMETRES)


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        ('{x = "nm"}', "heterogeneity.roughness = .*: needs file, the path of a text file with two columns"),
        ('{file = "a", x = "kg"}', 'heterogeneity.roughness.x = "kg": needs a unit of length, as nm'),
        ('{file = "a", detrend = "cubic"}', "needs one of none, mean, line, parabola"),
        ('{file = "a", w = "nm"}', 'heterogeneity.roughness.w = "nm": unknown'),
    ],
)
def test_a_wrong_entry_is_one_message(entry: str, said: str) -> None:
    with pytest.raises(ManifestError, match=said):
        parse_manifest(
            Path("mine.toml"), f'title = "x"\nheterogeneity.roughness = {entry}', {"roughness": TEXTS["tabs"]}
        )


def test_a_profile_is_shown_over_a_slab_of_any_width_above_0(main: Main, tmp_path: Path) -> None:
    (tmp_path / "afm.csv").write_text(TEXTS["commas"])
    for width, fits in (("20 um", True), ("0 m", False), ("-1 mm", False), ("inf", False), ("1 N", False)):
        code, shown, errors = main("profile", tmp_path / "afm.csv", "--x", "nm", "--z", "nm", "--width", width)
        assert (code == 0, "slope" in shown, "a number above 0" in errors) == (fits, fits, not fits)


@pytest.mark.slow
def test_profiles_are_an_axis_of_cases_named_by_their_files(main: Main, tmp_path: Path) -> None:
    """In labels, coordinates and when computed again; the text of each file is in the dataset."""
    for name, height in (("a.csv", 1.0), ("b.csv", 3.0)):
        (tmp_path / name).write_text("\n".join(f"{x} {height * (x % 7)}" for x in range(0, 900, 9)))
    one, other = (f'{{file = "{name}", x = "um", z = "nm"}}' for name in ("a.csv", "b.csv"))
    profiles = f'{one}, "none", {other}'
    small = "numerics.n_x = 65\nlimits.events = 30\nensemble.members = 1"
    text = f'title = "x"\naxes.roughness = [{profiles}]\n{small}'
    (tmp_path / "two.toml").write_text(text)
    data = api.run(tmp_path / "two.toml", tmp_path / "out", progress=False)
    assert data["roughness"].values.tolist() == ["a.csv", "none", "b.csv"]
    first, smooth, second = data["initial_force"].squeeze().values
    assert len({first, smooth, second}) == 3
    beside, cases = {"roughness": (tmp_path / "b.csv").read_text()}, expand(load_manifest(tmp_path / "two.toml"))
    alone = text.replace(f"axes.roughness = [{profiles}]", f"heterogeneity.roughness = {other}")
    (case,) = expand(parse_manifest(Path("one.toml"), alone, beside))
    assert case.case_id == cases[2].case_id
    assert [each.point.rpartition(" = ")[2] for each in cases] == ["a.csv", "none", "b.csv"]
    assert "3 bit-identical" in main("verify", tmp_path / "out")[1]


def test_profiles_of_an_axis_have_names_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("xi,height\n-0.1,0\n0.1,1e-4\n")
    (tmp_path / "twice.toml").write_text('title = "x"\naxes.roughness = ["a.csv", {file = "a.csv"}, "none.csv", 3.0]')
    with pytest.raises(ManifestError) as caught:
        load_manifest(tmp_path / "twice.toml")
    twice, missing, number = lines_of(caught.value)
    assert 'axes.roughness[1] = {"file": "a.csv"}: needs a file of its own' in twice
    assert "none.csv: " in missing
    assert "axes.roughness[3] = 3.0: " in number


IMAGE = np.round(np.random.default_rng(2).standard_normal((12, 8)), 3)
"""Heights in nm: twelve lines of eight along the drag, 20 nm apart."""
COLUMNS = "\n".join(
    ["x [nm],y [nm],z [nm]", *(f"{20 * i},{20 * j},{IMAGE[j, i]}" for j in range(12) for i in range(8))]
)
MATRIX = "# Height, Trace\n" + "\n".join("\t".join(map(str, line)) for line in IMAGE)
OF_MATRIX = NamedSurface("afm.txt", "", "nm", "none", "", "20 nm")


def test_a_matrix_and_columns_of_the_same_image_are_the_same() -> None:
    for found in (
        read_surface(AFM, MATRIX, OF_MATRIX),
        read_surface(AFM, MATRIX.replace("\n", "\t\n") + "\t\n# scan 1 2 3\n", OF_MATRIX),
        read_surface(AFM, COLUMNS, NamedSurface("a", detrend="none")),
    ):
        np.testing.assert_allclose(found.x, 20e-9 * (np.arange(8) - 3.5), atol=1e-21)
        np.testing.assert_allclose(found.y, 20e-9 * (np.arange(12) - 5.5), atol=1e-21)
        np.testing.assert_allclose(found.height, 1e-9 * IMAGE, atol=1e-21)
        image = make_image(found.roughness(1e-6))
        np.testing.assert_allclose(image.height, 1e-3 * IMAGE, atol=1e-15)


GWYDDION = "# Channel: Height\n# Width: 160 nm\n# Height: 0.24 µm\n# Value units: nm\n" + MATRIX.partition("\n")[2]


def test_a_matrix_has_the_size_and_unit_above_it() -> None:
    """Heights in nm under such a header were read as metres."""
    for given in (NamedSurface("a", detrend="none"), OF_MATRIX):
        found = read_surface(AFM, GWYDDION.replace("\n", "\r\n"), given)
        np.testing.assert_allclose(found.x, 20e-9 * (np.arange(8) - 3.5), atol=1e-21)
        np.testing.assert_allclose(found.y, 20e-9 * (np.arange(12) - 5.5), atol=1e-21)
        np.testing.assert_allclose(found.height, 1e-9 * IMAGE, atol=1e-21)


@pytest.mark.parametrize(
    ("change", "given"),
    [
        (("160 nm", "160 V"), NamedSurface("a")),
        (("160 nm", "0 nm"), NamedSurface("a")),
        (("160 nm", "160"), NamedSurface("a")),
        (("units: nm", "units: V"), NamedSurface("a")),
        (("Value units", "Unit"), NamedSurface("a")),
        (("units: nm", "units: m"), NamedSurface("a", z="nm")),
    ],
)
def test_what_stands_above_a_matrix_is_no_other_quantity(change: tuple[str, str], given: NamedSurface) -> None:
    with pytest.raises(InvalidInput):
        read_surface(AFM, GWYDDION.replace(*change), given)


@pytest.mark.parametrize("hole", ["0;nan", "nan;1", "0;", "0;-", "0;1e400", "0;#N/A", "4;7"])
def test_a_first_line_with_a_hole_leaves_names_and_units(hole: str) -> None:
    """Under such a line micrometres were read as metres; a count of points is no hole."""
    found = read_surface(AFM, f"x [um];z [nm]\n{hole}\n1;2\n2;4\n3;3\n4;1\n", NamedSurface("a", detrend="none"))
    np.testing.assert_allclose(found.x, [-1.5e-6, -0.5e-6, 0.5e-6, 1.5e-6], rtol=1e-12)
    np.testing.assert_allclose(found.height, [2e-9, 4e-9, 3e-9, 1e-9], rtol=1e-12)
    assert found.holes == (hole != "4;7")


def test_separators_of_thousands_are_refused() -> None:
    """Of forty such lines the four below 1000 were read."""
    lines = "\n".join(f"{250.0 * place:,.1f};{place % 7}" for place in range(40))
    with pytest.raises(InvalidInput, match="numbers in 4 of 40 lines"):
        read_surface(AFM, f"x [nm];z [nm]\n{lines}\n", NamedSurface("a"))


def test_heights_in_angstrom_are_read_and_in_unknown_units_refused() -> None:
    text = "x [um]\tz [Å]\n0\t1\n1\t2\n2\t1\n"
    np.testing.assert_allclose(read_surface(AFM, text, NamedSurface("a", detrend="none")).height, [1e-10, 2e-10, 1e-10])
    with pytest.raises(InvalidInput, match="z = 'nn': needs a unit of length"):
        read_surface(AFM, text.replace("Å", "nn"), NamedSurface("a"))
    given = read_surface(AFM, text.replace("Å", "digits"), NamedSurface("a", z="pm", detrend="none"))
    np.testing.assert_allclose(given.height, [1e-12, 2e-12, 1e-12])


def test_no_line_of_a_matrix_is_taken_for_a_count_of_points() -> None:
    assert read_surface(AFM, "3 1 2\n5 6 4\n7 7 7\n9 1 3\n", OF_MATRIX).height.shape == (4, 3)


@pytest.mark.parametrize(("detrend", "degree"), [("mean", 0), ("line", 1), ("parabola", 2)])
def test_what_is_taken_off_an_image_is_a_plane_or_a_paraboloid(detrend: Detrend, degree: int) -> None:
    x, y = np.meshgrid(np.arange(8.0), np.arange(12.0))
    trend = sum(((1.0, 0.3 * x - 0.2 * y, 0.02 * x * y - 0.05 * y**2)[: degree + 1]), 0.0)
    given = NamedSurface("a", "", "nm", detrend, "", "20 nm")
    plain, tilted = (
        read_surface(AFM, "\n".join(" ".join(map(repr, line.tolist())) for line in heights), given).height
        for heights in (IMAGE, IMAGE + trend)
    )
    np.testing.assert_allclose(tilted, plain, atol=1e-21)
    assert abs(plain.mean()) < 1e-21


@pytest.mark.parametrize(
    "text",
    [
        "1 2\n4 5 6\n7 8 9\n",
        "1\n4 5 6\n7 8 9\n",
        "1 2 3 4\n4 5 6\n7 8 9\n",
        MATRIX + "\n1 2",
        MATRIX.replace(str(IMAGE[3, 4]), "-", 1),
        "1 2 3\nscan\n1 2 3",
        "1\n2\n3",
        "1 2 3",
    ],
)
def test_a_matrix_with_a_hole_is_refused(text: str) -> None:
    with pytest.raises(InvalidInput):
        read_surface(AFM, text, OF_MATRIX)


@pytest.mark.parametrize("text", [COLUMNS.rpartition("\n")[0], COLUMNS.replace("nm", "N"), "x,y,z\n0,0,1\n1,0,1"])
def test_columns_that_are_no_image_are_refused(text: str) -> None:
    with pytest.raises(InvalidInput):
        read_surface(AFM, text, NamedSurface("a", detrend="none"))


@pytest.mark.parametrize(
    "entry", ['pixel = "20 N"', "pixel = 20", 'pixel = "-1 nm"', 'y = "kg"', 'pixel = "20 nm", x = "nm"']
)
def test_a_wrong_entry_of_an_image_is_one_message(entry: str) -> None:
    text = f'title = "x"\nheterogeneity.roughness = {{file = "a", {entry}}}\nnumerics = {{scheme = "half_space", n_x = 17}}'
    with pytest.raises(ManifestError) as caught:
        parse_manifest(Path("mine.toml"), text, {"roughness": MATRIX})
    assert len(lines_of(caught.value)) == 1


@pytest.mark.parametrize(
    ("pixel", "agrees"), [("", True), ("250 nm", True), ("0.262 um", True), ("20 nm", False), ("2.5 um", False)]
)
def test_a_given_spacing_does_not_replace_another_one_that_the_file_states(pixel: str, agrees: bool) -> None:
    """Of 20 heights over 5 µm, which are 250 nm apart, or 263 nm from the first to the last."""
    header = "# Width: 5 µm\n# Height: 6 µm\n# Value units: m\n"
    text = header + "\n".join(" ".join(f"{each:.9g}" for each in line) for line in SMOOTH_IMAGE)
    given = NamedSurface("a", detrend="none", pixel=pixel)
    if agrees:
        assert read_surface(AFM, text, given).x[-1] == pytest.approx(2.5e-6, rel=0.06)
        return
    with pytest.raises(InvalidInput, match="pixel = ") as caught:
        read_surface(AFM, text, given)
    assert "250 nm" in str(caught.value)


def test_a_matrix_without_a_scale_is_refused_with_the_key_that_has_it() -> None:
    text = "\n".join(" ".join(f"{each:.9g}" for each in line) for line in SMOOTH_IMAGE)
    with pytest.raises(InvalidInput, match="pixel"):
        read_surface(AFM, text, NamedSurface("a"))
    assert read_surface(AFM, text, NamedSurface("a", pixel="250 nm")).height.shape == SMOOTH_IMAGE.shape


@pytest.mark.slow
def test_a_campaign_of_balls_takes_an_image_and_one_of_cylinders_does_not(main: Main, tmp_path: Path) -> None:
    """The dataset holds the image, so that its cases can be computed again."""
    (tmp_path / "afm.txt").write_text(MATRIX)
    rough = 'heterogeneity.roughness = {file = "afm.txt", pixel = "20 nm", z = "pm"}'
    small = 'limits.events = 30\nensemble.members = 2\nscales.slab_width = "200 nm"\nconstants.normal_load = 2e-4'
    text = f'title = "x"\n{rough}\n{small}\nnumerics = {{n_x = 17, scheme = "SCHEME"}}'
    for scheme in ("layer", "strip"):
        (tmp_path / f"{scheme}.toml").write_text(text.replace("SCHEME", scheme))
    data = api.run(tmp_path / "layer.toml", tmp_path / "out", progress=False)
    assert data.attrs["manifest_roughness"] == MATRIX
    assert data["outcome"].item() == "no_plateau"  # after 30 events
    assert "1 bit-identical" in main("verify", tmp_path / "out")[1]
    with pytest.raises(ManifestError) as caught:
        load_manifest(tmp_path / "strip.toml")
    assert len(lines_of(caught.value)) == 1


def test_an_image_has_slopes_along_and_across_and_a_picture(main: Main, tmp_path: Path) -> None:
    (tmp_path / "afm.txt").write_text(MATRIX)
    code, shown, _ = main("profile", tmp_path / "afm.txt", "--pixel", "20 nm", "--z", "nm", "--width", "1 um")
    assert code == 0
    along, across = (np.sqrt((np.diff(IMAGE, axis=axis) ** 2).mean()) / 20.0 for axis in (1, 0))
    numbers = [float(found) for found in re.findall(r"0\.\d+", shown)]
    assert min(abs(each / along - 1.0) for each in numbers) < 0.01
    assert min(abs(each / across - 1.0) for each in numbers) < 0.01
    main("profile", tmp_path / "afm.txt", "--pixel", "20 nm", "--z", "nm", "-o", tmp_path / "afm.png")
    assert (tmp_path / "afm.png").stat().st_size > 1000


SMOOTH_IMAGE = 1e-8 * np.cos(np.arange(24.0)[:, None] / 4.0) * np.sin(np.arange(20.0) / 3.0)
HOLES = [(0, 10), (4, 13), (8, 8), (8, 9), (9, 8), (23, 19)]


def points_of(image: NDArray[np.float64], absent: str = "nan") -> list[str]:
    """Lines x, y (µm), z (nm); missing heights as this text."""
    rows = []
    for (line, column), height in np.ndenumerate(image):
        shown = absent if (line, column) in HOLES else f"{1e9 * height:.6f}"
        rows.append(f"{0.5 * column:g} {0.5 * line:g} {shown}")
    return rows


@pytest.mark.parametrize("absent", ["nan", "-9999", "99999", "--", ""])
def test_missing_heights_of_an_image_are_counted_and_filled_on_request(absent: str) -> None:
    """-9999 is no height where all others are within 20 nm; a smooth image is filled within its curvature."""
    lines = points_of(SMOOTH_IMAGE, absent)
    text = "\n".join(["x [um] y [um] z [nm]", *(line for line in lines if absent or not line.endswith(" "))])
    given = NamedSurface("a", detrend="none")
    with pytest.raises(InvalidInput, match=f"{len(HOLES)} heights are missing"):
        read_surface(AFM, text, given)
    found = read_surface(AFM, text, replace(given, missing="fill"))
    assert found.filled == len(HOLES)
    np.testing.assert_allclose(found.height, SMOOTH_IMAGE, atol=0.15e-8)
    whole = [line for line in points_of(SMOOTH_IMAGE, "5.0") if line]
    assert read_surface(AFM, "\n".join(["x [um] y [um] z [nm]", *whole]), given).filled == 0


def test_columns_without_a_header_and_arrays_of_numpy_are_images() -> None:
    text = "\n".join(
        f"{5e-7 * column:.9g} {5e-7 * line:.9g} {height:.9g}" for (line, column), height in np.ndenumerate(SMOOTH_IMAGE)
    )
    found = read_surface(AFM, text, NamedSurface("a", detrend="none"))
    np.testing.assert_allclose(found.height, SMOOTH_IMAGE, rtol=1e-7, atol=1e-17)
    written = io.BytesIO()
    np.save(written, SMOOTH_IMAGE)
    again = read_surface(AFM, decode_text(written.getvalue()), NamedSurface("a", detrend="none", pixel="500 nm"))
    np.testing.assert_array_equal(again.height, SMOOTH_IMAGE)
    np.testing.assert_allclose(again.x, found.x, atol=1e-15)
