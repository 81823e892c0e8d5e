"""A campaign file is read whole or refused whole: one line per problem, naming file, key, value and what is allowed."""

import hashlib
import re
from pathlib import Path

import pytest

from nanoslip.solver.drive import Scales
from nanoslip.solver.ensemble import ALONE, Ensemble
from nanoslip.study.manifest.cases import expand
from nanoslip.study.manifest.manifest import Manifest, NamedDrive
from nanoslip.study.manifest.problems import LONGEST_PATH, MOST_LINES, ManifestError, path_shown
from nanoslip.study.manifest.reader import load_manifest, parse_manifest
from nanoslip.study.plan.plan import make_plan
from tests.study.manifest.problems import lines_of

ROOT = Path(__file__).parents[3]
CAMPAIGNS = ROOT / "campaigns"


def written(folder: Path, text: str, name: str = "mine.toml") -> Path:
    path = folder / name
    path.write_text(text, "utf-8")
    return path


def read(folder: Path, text: str) -> Manifest:
    return load_manifest(written(folder, text))


def problems(folder: Path, text: str) -> tuple[str, ...]:
    """The lines of the error, without the file's path, which each of them must start with."""
    path = written(folder, text)
    with pytest.raises(ManifestError) as error:
        load_manifest(path)
    assert all(line.startswith(f"{folder}/") and "\n" not in line for line in lines_of(error.value))
    assert str(error.value) == "\n".join(lines_of(error.value))
    return tuple(line.removeprefix(f"{path}: ").removeprefix(f"{folder}/") for line in lines_of(error.value))


def test_the_least_campaign_is_a_title(tmp_path):
    manifest = read(tmp_path, 'title = "one case"')
    assert manifest.stages == ("contact", "slip")
    assert manifest.design == "product"
    assert (manifest.axes, manifest.fixed, manifest.drives) == ({}, {}, ())
    assert manifest.scales == Scales()
    assert manifest.name == "mine"


def test_numbers_take_their_declared_type(tmp_path):
    manifest = read(tmp_path, 'title = "x"\naxes.radius = [50, 200.0]\nconstants.normal_load = 1\nnumerics.n_x = 33.0')
    assert [repr(value) for value in manifest.axes["radius"]] == ["50.0", "200.0"]
    assert repr(manifest.fixed) == "{'normal_load': 1.0, 'n_x': 33}"


def test_the_hash_covers_the_file_and_its_table(tmp_path):
    table = written(tmp_path, "radius\n50\n", "cases.csv")
    path = written(tmp_path, 'title = "µ"\ntable = "cases.csv"')
    first = load_manifest(path)
    assert first.sha256 == hashlib.sha256(path.read_bytes() + table.read_bytes()).hexdigest()
    assert (first.text, first.files["table"]) == (path.read_text("utf-8"), "radius\n50\n")
    table.write_text("radius\n51\n")
    assert load_manifest(path).sha256 != first.sha256


def test_an_empty_cell_leaves_a_schemes_setting_out(tmp_path):
    written(tmp_path, "scheme,coupling_stiffness\ngalerkin,\nchain,3\nchain,\n", "cases.csv")
    slab, given, own = expand(read(tmp_path, 'title = "x"\ntable = "cases.csv"'))
    assert [each.case.flat["coupling_stiffness"] for each in (slab, given, own) if each.case] == [None, 3.0, 30.0]
    assert "coupling_stiffness" not in slab.parameters
    written(tmp_path, "radius,n_x\n,17\n", "cases.csv")
    with pytest.raises(ManifestError, match='line 2: radius = ""'):
        read(tmp_path, 'title = "x"\ntable = "cases.csv"')


def test_a_table_of_cases_becomes_axes_read_together(tmp_path):
    written(tmp_path, '\ufeffn_x, radius ,pin\r\n65, 50, parabola\r\n\r\n129,2e2,"flat_punch"\r\n', "cases.csv")
    manifest = read(tmp_path, 'title = "x"\ntable = "cases.csv"')
    assert manifest.design == "table"
    assert manifest.axes == {"n_x": (65, 129), "radius": (50.0, 200.0), "pin": ("parabola", "flat_punch")}


def test_a_title_is_any_text_of_one_line(tmp_path):
    for title in ("", "μ_i über 日本語", "👩‍🔬 <b>%s</b> {{ 7 }}", "x" * 1000):
        assert read(tmp_path, f'title = "{title}"').title == title
    for title in ("\u202e", "x" * 1001):
        with pytest.raises(ManifestError, match="title"):
            read(tmp_path, f'title = "{title}"')


def test_drives_that_no_stage_computes_are_checked_and_left_out(tmp_path):
    text = 'title = "x"\nstages = ["contact", "slip"]\n[[drives]]\nname = "slow"\n[[drives]]\nname = "fast"\n'
    manifest = read(tmp_path, text)
    assert (manifest.drives, manifest.drives_left_out) == ((), ("slow", "fast"))
    assert read(tmp_path, text.replace(', "slip"]', ', "slip", "dynamics"]')).drives_left_out == ()
    with pytest.raises(ManifestError, match=r"drives\[1\]\.pin_mass = 0"):
        read(tmp_path, text + "pin_mass = 0\n")


def test_an_ensemble_is_a_number_of_members_or_a_target(tmp_path):
    assert read(tmp_path, 'title = "x"').ensemble == Ensemble(8)
    assert read(tmp_path, 'title = "x"\nensemble.members = 1').ensemble == ALONE
    assert read(tmp_path, 'title = "x"\nensemble.places = "given"').ensemble == Ensemble(8, places="given")
    target = 'title = "x"\ntarget.within = 0.01\n'
    assert read(tmp_path, target).ensemble == Ensemble(96, 0.01, ("plateau_mean",))
    assert read(tmp_path, target + 'stages = ["contact"]').ensemble.of == ("contact_half_width",)
    assert read(tmp_path, target + DRIVE).ensemble.of == ("plateau_mean", "static_friction", "kinetic_friction")
    given = 'target.of = ["approach", "mean_step"]\ntarget.most = 3\noutputs.tractions = true'
    assert read(tmp_path, target + given).ensemble == Ensemble(3, 0.01, ("approach", "mean_step"))


def test_tractions_are_kept_where_they_are_the_question(tmp_path):
    assert read(tmp_path, 'title = "x"\nstages = ["contact"]').outputs.tractions
    assert not read(tmp_path, 'title = "x"').outputs.tractions
    assert not read(tmp_path, 'title = "x"\nstages = ["contact"]\noutputs.tractions = false').outputs.tractions


DRIVE = '[[drives]]\nname = "a"\n'


def many(key: str, count: int) -> str:
    """An axis of so many values."""
    return f"{key} = {[1 + number / 1000 for number in range(count)]}\n"


def said(found: str, text: str, line: str) -> bool:
    """Whether what is found is a line of the table WRONG."""
    whole = text + line if line.startswith(":") else line
    return re.fullmatch(".*".join(map(re.escape, whole.split("…"))), found) is not None


WRONG = {
    "axes.mu_i = [0.3]": ": unknown; did you mean intrinsic_friction?",
    "constants.W = 1": ": unknown; did you mean normal_load?",
    "axes.stage_velocity = [1]": ": belongs in [[drives]] or [drive_axes]",
    "constants.V_o = 1": ": unknown; did you mean stage_velocity, which belongs in [[drives]] or [drive_axes]?",
    "": "title: missing: needs a text",
    "title = 5": ": needs a text",
    'title = "a\\nb"': ": needs to be one line without control characters",
    'title = "\\u202e\\u009b31m"': 'title = "\\u202e\\x9b31m": needs to be one line without control characters',
    "stage = 1": ": unknown; did you mean stages?",
    "numerics.members = 4": ": belongs in [ensemble]",
    "numerics.pin_mass = 4": ": belongs in [[drives]] or [drive_axes]",
    "n_x = 33": ": belongs in [numerics] or [axes]",
    "constants = 1": ": needs a table [constants]",
    "axes = [,": "…not TOML: …line 2…",
    'stages = ["contact", "dynamics"]': '…stages = …: needs ["contact"] or …',
    'stages = ["slip", "contact"]': "…each stage needs the ones before it…",
    'stages = ["contact", "slip", "dynamics"]': (
        'drives: missing: needs at least one [[drives]] or [drive_axes], for stage "dynamics"'
    ),
    "drives = [1]": "drives[0] = 1: needs a table [[drives]]",
    "[[drives]]\n[[drives]]": 'drives[1].name = "default": is another drive\'s name too: needs its own',
    "[[drives]]\nname = 3": "drives[0].name = 3: needs a name",
    '[[drives]]\nname = "\\u001b[31m"': 'drives[0].name = "\\u001b[31m": needs to be one line without control characters',
    DRIVE + DRIVE: 'drives[1].name = "a": is another drive\'s name too: needs its own',
    DRIVE + "mass = 1": "drives[0].mass = 1: unknown; did you mean pin_mass?",
    DRIVE + "spring_stiffness = true": "drives[0].spring_stiffness = true: needs a number",
    DRIVE + 'duration = "automatic"': 'drives[0].duration = "automatic": needs a number',
    DRIVE + 'duration = "auto"\nduration_periods = 3': "drives[0].duration_periods = 3.0: needs to be left out "
    "beside duration = 'auto'",
    'drive_axes.duration = ["auto"]': 'drive_axes.duration[0] = "auto": needs a number on an axis',
    DRIVE + "duration = -1.0": "drives[0].duration = -1.0: needs 1e-30 ≤ duration ≤ 1e30",
    DRIVE + 'integrator = "rk4"': "drives[0].time_step: missing: needs 0 < time_step ≤ duration with rk4",
    DRIVE
    + 'duration = 0.2\nintegrator = "rk4"\ntime_step = 1.0': "drives[0].time_step = 1.0: needs 0 < time_step ≤ duration with rk4",
    DRIVE + "time_step = 1e-7": 'drives[0].time_step = 1e-07: needs integrator = "rk4"',
    DRIVE + 'surface_compliance = false\nintegrator = "rk4"\ntime_step = 1e-7': (
        'drives[0].surface_compliance = false: needs integrator = "exact", as a step of rk4 has no rest'
    ),
    DRIVE + "reverse_motion = 1": "drives[0].reverse_motion = 1: needs true or false",
    DRIVE + 'profile = "average"': (
        'drives[0].profile = "average": needs one of sawtooth, coarse, linear, mean; a measured surface is `roughness = FILE`'
    ),
    DRIVE + "[scales]\nshear_modulus = 1e-20\nslab_depth = 1e-20": (
        "drives[0].spring_stiffness = 200000.0: needs 1e-30 ≤ spring_stiffness ≤ 1e-10 with this pin_mass and these scales"
    ),
    "axes.radus = [1]": ": unknown; did you mean radius?",
    "axes.q = [1]": "…axes.q = …: unknown; needs one of intrinsic_friction, radius…",
    "axes.radius = []": ": needs a list of at least one value",
    "axes.radius = [1]\nconstants.radius = 1": "constants.radius: is an axis too: needs one place",
    "limits.displacement = 0": ": needs displacement > 0",
    "axes.radius = [50, -5]": "axes.radius[1] = -5: needs 1e-12 ≤ radius ≤ 1e24",
    "constants.radius = inf": ": needs a finite number",
    "axes.normal_load = [nan]": "axes.normal_load[0] = nan: needs a number",
    'constants.normal_load = "1e-3"': ": needs a number",
    "axes.n_x = [true]": "axes.n_x[0] = true: needs a whole number",
    "constants.normal_load = 2022-03-30": 'constants.normal_load = "2022-03-30": needs a number',
    "limits.events = 2.5": ": needs a whole number",
    "numerics.n_x = 100": ": needs 2^N + 1 with N from 2 to 20: 5, 9, 17, 33, 65, 129 … 1048577",
    'numerics.scheme = "half_plane"\naxes.n_x = [101, 100]': "axes.n_x[1] = 100: needs an odd number from 5 to 1048577",
    "constants.poisson = 0.51": ": needs -1 < poisson ≤ 0.5",
    "constants.poisson = 0.5": ": needs less than 0.5 with a grid; others take 0.5",
    'numerics.support = "glued"': ": needs one of bonded, frictionless, right_side",
    "slip.residual_shear = 1.5": ": needs 0 ≤ residual_shear ≤ 1",
    'axes.n_x = [17, 33]\nnumerics.rows = 7\nnumerics.scheme = "biquadratic"': (
        "numerics.rows = 7: needs 3 to 6 rows at n_x = 33"
    ),
    "numerics.rows = 5": ': needs scheme = "biquadratic"',
    "axes.rows_per_level = [2, 0]": "axes.rows_per_level[1] = 0: needs 1 to 1024",
    "scales.slab_width = -1": ": needs 1e-30 ≤ slab_width ≤ 1e30",
    "outputs.records = 1": ": needs true or false",
    "outputs.tractions_at = [3, 3]": "…tractions_at = [3, 3]: needs a list of events…",
    'stages = ["contact"]\noutputs.tractions_at = [0, 5]': (
        'outputs.tractions_at = [0, 5]: needs stage "slip" for the events after 0'
    ),
    "heterogeneity.roughness = 1": ": needs the path of a CSV file with xi and height",
    'heterogeneity.roughness = "none.csv"': "…none.csv: cannot be read…",
    "heterogeneity.spread = -0.1": "…needs 0 ≤ spread…",
    "limits.seconds = 0.09": ": needs a number of seconds from 0.1 on",
    "limits.seconds = inf": ": needs a number of seconds from 0.1 on",
    'stages = ["contact"]\noutputs.statistics = true': '…outputs.statistics = true: needs stage "slip"…',
    "ensemble.members = true": ": needs a whole number",
    "ensemble.members = 10001": ": needs 1 to 10000",
    "target = {within = 5, of = ['plateau_mean'], most = 9}": "target.within = 5: needs 0 < within < 1",
    "target = {within = 0.1, most = 2}": "target.most = 2: needs 3 to 10000",
    "target.within = 0.1\nensemble.members = 8": "…ensemble.members = 8: needs to be left out beside [target]…",
    "target.of = ['plateau_mean']": "[target]: needs within = 0.01, or another relative error",
    "ensemble.places = 'any'": 'ensemble.places = "any": needs one of drawn, given',
    "target = {within = 0.1, of = 'plateau_mean'}": (
        '…target.of = "plateau_mean": needs a list, each one of contact_half_width, …'
    ),
    "target = {within = 0.1, of = ['events']}": "…target.of = …events…: needs a list, each one of contact_half_width, …",
    "target = {within = 0.1, of = ['static_friction']}": (
        '…target.of = "static_friction": needs stage "dynamics", which a [[drives]] table brings…'
    ),
    "target = {within = 0.1, of = ['approach']}": (
        '…target.of = "approach": needs stages = ["contact"] or outputs.tractions = true…'
    ),
    'design = "grid"': '…design = "grid": needs "product", "zip", "sobol" or…',
    'design = "zip"\n[axes]\nradius = [1, 2]\nnormal_load = [1e-3]': (
        'design = "zip": needs axes of equal length, got 2 of radius, 1 of normal_load'
    ),
    'table = "good.csv"\naxes.normal_load = [1e-3]': 'axes: needs to be left out beside table = "good.csv"',
    'table = "none.csv"': "none.csv: cannot be read: No such file or directory",
    'table = "\\u0000"': "…name of a file: needs to be one line without control…",
    'table = "good.csv"\nconstants.radius = 1': "constants.radius: is an axis too: needs one place",
    'table = "negative.csv"': "negative.csv: line 4: radius = -5: needs 1e-12 ≤ radius ≤ 1e24",
    'table = "still.csv"': "still.csv: line 3: spacings = 0: needs spacings > 0",
    'table = "hole.csv"': 'hole.csv: line 2: radius = "": needs a number',
    'table = "column.csv"': 'column.csv: column "radus": unknown; did you mean radius?',
    'table = "passwd"': "passwd: line 1: needs a header of parameters, as intrinsic_friction,radius",
    'heterogeneity.roughness = "passwd"': "passwd: line 1: needs the header xi,height",
    "interface.measured_loads = [1.0]": ": needs the path of a CSV file with load",
    'interface.measured_loads = "good.csv"': "good.csv: line 1: needs the header load",
    'interface.measured_loads = "loads.csv"': 'loads.csv: line 4: "-2": needs finite loads above 0',
    'table = "twice.csv"': "twice.csv: column radius: needs to appear once",
    'table = "ragged.csv"': "ragged.csv: line 3: 1 values: needs 2, one for each column",
    'table = "header.csv"': "…header.csv: 1 lines: needs a header…",
    'table = "quotes.csv"': "…quotes.csv: line 2: not CSV: …",
    'table = "binary.csv"': '…binary.csv: line 2: radius = "ÿ"…',
    "x = " + "[" * 5000: "nested too deeply: needs fewer brackets within brackets",
    f"[axes]\n{many('radius', 1001)}{many('aspect_ratio', 1000)}": "1001000 cases: needs at most 1000000; split an axis…",
    f"[drive_axes]\n{many('pin_mass', 1001)}{many('spring_stiffness', 1000)}": (
        "drive_axes: 1001000 drives: needs at most 1000000"
    ),
    f"[axes]\n{many('radius', 401)}{many('aspect_ratio', 1000)}[drive_axes]\n{many('pin_mass', 11)}": (
        "401000 cases with 11 drives each: needs at most 4000000 drives in all; split an axis…"
    ),
}
"""What is wrong, and the line that says so; one that begins with a colon begins with what is wrong, and … is any text."""

TABLE_FILES = {
    "good.csv": b"radius\n50\n",
    "loads.csv": b"load\n1\n\n-2\n",
    "negative.csv": b"radius,normal_load\n50,1e-3\n\n-5,1e-3\n",
    "still.csv": b"radius,spacings\n50,1\n50,0\n",
    "hole.csv": b"radius,normal_load\n,1e-3\n",
    "passwd": b"root:x:0:0:root:/root:/bin/bash\nguest,x,1\n",
    "column.csv": b"radus\n50\n",
    "twice.csv": b"radius,radius\n50,50\n",
    "ragged.csv": b"radius,normal_load\n50,1e-3\n50\n",
    "header.csv": b"radius,normal_load\n",
    "quotes.csv": b'radius\n"50"1\n',
    "binary.csv": b"radius\n\xff\n",
}


@pytest.mark.parametrize(("text", "line"), WRONG.items(), ids=lambda text: text[:50])
def test_a_wrong_file_is_refused_in_one_line(tmp_path, text, line):
    for name, content in TABLE_FILES.items():
        (tmp_path / name).write_bytes(content)
    (found,) = problems(tmp_path, text if not text or text.startswith("title") else f'title = "x"\n{text}')
    assert said(found, text, line), found


def test_a_million_cases_are_not_too_many():
    text = f'title = "Many"\n[axes]\n{many("radius", 1000)}{many("aspect_ratio", 1000)}'
    assert parse_manifest(Path("mine.toml"), text, {}).case_count == 10**6


def test_every_problem_is_told_at_once(tmp_path):
    text = 'stages = [1]\naxes.radius = [-1, 5, "a"]\nnumerics.n_x = 6\ndrive_axes.spring_stiffness = [3, 0, -1]\n'
    text += "[[drives]]\npin_mass = -1\nduration = 0\n"
    found = problems(tmp_path, text)
    keys = "title stages axes.radius[0] axes.radius[2] numerics.n_x drive_axes.spring_stiffness[1]"
    keys += " drive_axes.spring_stiffness[2] drives[0].pin_mass drives[0].duration"
    assert sorted(line.split(":")[0].split(" = ")[0] for line in found) == sorted(keys.split())


def test_of_very_many_problems_the_first_are_listed_and_the_rest_counted(tmp_path):
    with pytest.raises(ManifestError) as error:
        load_manifest(written(tmp_path, f'title = "x"\naxes.radius = {[-1 - i for i in range(MOST_LINES + 2)]}'))
    listed = str(error.value).splitlines()
    assert (len(lines_of(error.value)), listed[:-1], listed[-1]) == (
        MOST_LINES + 2,
        list(lines_of(error.value)[:MOST_LINES]),
        "and 2 problems more",
    )


@pytest.mark.parametrize("odd", ["a\nb", "a\x1b[31mb", "a\u2028b"])
def test_a_file_whose_name_writes_to_terminals_is_refused(tmp_path, odd):
    path = tmp_path / f"{odd}.toml"
    path.write_text('title = "x"')
    with pytest.raises(ManifestError, match="one line") as error:
        load_manifest(path)
    assert str(error.value).isprintable()


def test_a_device_or_a_folder_is_no_file(tmp_path):
    """A device would be read without end."""
    with pytest.raises(ManifestError, match="regular file"):
        load_manifest(tmp_path)
    path = tmp_path / "x.toml"
    path.write_text('title = "x"\ntable = "/dev/zero"\n')
    with pytest.raises(ManifestError, match=r"/dev/zero: .*regular file"):
        load_manifest(path)


def test_text_in_another_encoding_is_refused(tmp_path):
    (tmp_path / "latin.toml").write_bytes('title = "µ"'.encode("latin-1"))
    with pytest.raises(ManifestError, match=r"byte 9: .*UTF-8"):
        load_manifest(tmp_path / "latin.toml")


@pytest.mark.parametrize(
    ("axes", "fits", "refused"),
    [
        ('scheme = ["galerkin", "half_plane"]\naxes.n_x = [33, 101]', [1, 0, 1, 1], "n_x = 101: needs 2^N + 1"),
        ('scheme = ["galerkin", "strip"]\naxes.poisson = [0.3, 0.5]', [1, 0, 1, 1], "poisson = 0.5: needs less than"),
        ('scheme = ["strip", "half_plane"]\naxes.poisson = [0.5]', [1, 1], ""),
    ],
)
def test_what_one_of_the_campaigns_schemes_takes_is_no_error_of_the_file(tmp_path, axes, fits, refused):
    """The cases that it does not fit are refused, each by itself."""
    cases = expand(read(tmp_path, f'title = "x"\naxes.{axes}'))
    assert [case.case is not None for case in cases] == fits
    assert all(case.outcome.message.startswith(refused) for case in cases if case.case is None)


@pytest.mark.parametrize("path", sorted(CAMPAIGNS.rglob("*.toml")), ids=lambda path: path.stem)
def test_the_campaigns_of_the_repository_are_good(path):
    assert load_manifest(path).title


@pytest.mark.parametrize("page", ["README.md", "docs/start.md"])
def test_the_first_campaign_that_a_reader_meets_works(tmp_path, page):
    text = (ROOT / page).read_text("utf-8").split("```toml\n")[1].split("```")[0]
    assert len(read(tmp_path, text).axes["normal_load"]) == 4


def test_every_campaign_on_a_page_is_a_good_one(tmp_path):
    """Blocks with a title; others are parts of one."""
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
    texts = [text.split("```")[0] for page in pages for text in page.read_text("utf-8").split("```toml\n")[1:]]
    whole = [text for text in texts if text.startswith("title = ")]
    assert len(whole) >= 3
    for text in whole:
        assert read(tmp_path, text).title


def test_a_manifest_is_the_same_from_its_texts_alone_and_no_file_is_read(tmp_path):
    beside = {
        "table": "radius\n50\n100\n",
        "roughness": "xi,height\n-0.1,0\n0.1,1e-6\n",
        "measured_loads": "load\n1\n",
    }
    for key, text in beside.items():
        (tmp_path / key).write_text(text)
    text = 'title = "x"\ntable = "table"\nheterogeneity.roughness = "roughness"\n'
    text += 'interface.measured_loads = "measured_loads"\n'
    there = read(tmp_path, text)
    for key in beside:
        (tmp_path / key).unlink()
    assert parse_manifest(there.path, text, beside) == there
    for key in beside:
        with pytest.raises(ManifestError, match=f"{key}: the text of its file is missing"):
            parse_manifest(there.path, text, {name: beside[name] for name in beside if name != key})


def test_the_time_of_a_task_limits_no_case(tmp_path):
    """Neither its results nor its key: what takes too long here may not elsewhere."""
    given = 'title = "x"\n[limits]\nspacings = 1.0\n'
    plain, timed = (
        make_plan(parse_manifest(tmp_path / "mine.toml", given + more, {})) for more in ("", "seconds = 7\n")
    )
    assert [task.key for task in plain.tasks] == [task.key for task in timed.tasks]
    assert {task.limit for task in timed.tasks} == {7.0}
    assert all(task.limit >= max(600.0, 99.0 * task.cost) for task in plain.tasks)


def test_a_drive_loses_its_units_by_the_scales():
    """Mass 1, stiffness in G·L_y = 1e8 N/m, time in √(m/(G·L_y)) = 70.7 µs, length in L_x = 1 mm."""
    drive = NamedDrive.of("rk4", duration=0.2, integrator="rk4", time_step=1e-7).dimensionless(Scales())
    time = (0.5 / 1e8) ** 0.5
    assert drive.spring_stiffness == pytest.approx(2e-3, rel=1e-15)
    assert drive.stage_velocity == pytest.approx(2.0 * time, rel=1e-15)
    assert drive.duration == pytest.approx(0.2 / time, rel=1e-15)
    assert drive.integrator.time_step == pytest.approx(1e-7 / time, rel=1e-15)


@pytest.mark.parametrize("length", [1, LONGEST_PATH, LONGEST_PATH + 1, 2 * LONGEST_PATH])
def test_a_path_of_any_length_is_named_by_its_beginning(length: int) -> None:
    shown = path_shown(Path("x" * length))
    assert len(shown) == min(length, LONGEST_PATH)
    assert (shown == "x" * length) == (length <= LONGEST_PATH)
