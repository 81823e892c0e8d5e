"""A wheel is whole: installed elsewhere, without the source tree, it computes, reports, submits and names its commit."""

import os
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest
import xarray as xr

from nanoslip.study.provenance import source_commit, version
from nanoslip.study.shipped import campaign_files
from tests.conftest import ROOT

pytestmark = pytest.mark.slow

DOCUMENTATION = {".csv", ".md", ".png", ".svg"}
"""Further files of the packages' folders, for those who read the source tree."""
TINY = 'title = "tiny"\nstages = ["contact"]\n[axes]\nnormal_load = [1e-3, 2e-3]\n[numerics]\nn_x = 17\n'


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this source tree, built with the setuptools that is here and outside the tree."""
    pytest.importorskip("setuptools", minversion="77", reason="needs the setuptools that pyproject.toml asks for")
    folder = tmp_path_factory.mktemp("wheel")
    (folder / "build.cfg").write_text(f"[build]\nbuild_base = {folder / 'build'}\n[egg_info]\negg_base = {folder}\n")
    words = ["wheel", ROOT, "--no-deps", "--no-build-isolation", "--no-index", "--wheel-dir", folder]
    pip(*words, DIST_EXTRA_CONFIG=str(folder / "build.cfg"))
    (found,) = folder.glob("nanoslip-*.whl")
    return found


@pytest.fixture(scope="module")
def installed(wheel: Path) -> Path:
    """The programs of an environment that has the wheel, and the dependencies of this one."""
    return environment(wheel.parent / "venv", wheel)


def environment(folder: Path, *wheels: Path) -> Path:
    """The programs of a new environment with these wheels, and the dependencies of this one."""
    venv.create(folder)
    pip("--python", folder / "bin" / "python", "install", "--no-deps", "--no-index", *wheels)
    library = Path(sysconfig.get_path("purelib", "venv", {"base": str(folder)}))
    (library / "dependencies.pth").write_text("\n".join(path for path in sys.path if path.endswith("-packages")))
    return folder / "bin"


def test_a_source_tree_is_found_from_the_folder_that_it_is_in(tmp_path: Path) -> None:
    """There its folder, perhaps `nanoslip`, is a package without `__init__.py`, which comes before what an import hook finds."""
    (tmp_path / "build.cfg").write_text(f"[build]\nbuild_base = {tmp_path}\n[egg_info]\negg_base = {tmp_path}\n")
    build = f"from setuptools.build_meta import build_editable; build_editable({str(tmp_path)!r})"
    apart = os.environ | {"DIST_EXTRA_CONFIG": str(tmp_path / "build.cfg")}
    subprocess.run([sys.executable, "-c", build], cwd=ROOT, env=apart, capture_output=True, check=True)
    python = environment(tmp_path / "venv", *tmp_path.glob("*.whl")) / "python"
    (tmp_path / "nanoslip").mkdir()
    print_version = [python, "-c", "import nanoslip; print(nanoslip.__version__)"]
    assert subprocess.check_output(print_version, cwd=tmp_path, text=True) == f"{version()}\n"


@pytest.fixture
def call(installed: Path, tmp_path: Path):
    """Run a program of that environment in an empty folder; returns what it prints."""

    def called(program: str, *words: object) -> str:
        kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
        environment = kept | {"PATH": os.defpath}  # no git
        done = subprocess.run(
            [installed / program, *map(str, words)],
            cwd=tmp_path,
            env=environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return called


def pip(*words: object, **changes: str) -> None:
    done = subprocess.run(
        [sys.executable, "-m", "pip", "--disable-pip-version-check", *map(str, words)],
        env=os.environ | changes,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr


def test_the_wheel_holds_every_file_of_the_packages_and_no_test(wheel):
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if ".dist-info/" not in name}
    tracked = subprocess.run(
        ["git", "-C", ROOT, "ls-files", "solver", "study"], capture_output=True, text=True, check=True
    )
    there = {
        f"nanoslip/{name}"
        for name in tracked.stdout.split()
        if (ROOT / name).exists() and Path(name).suffix not in DOCUMENTATION
    }
    assert there <= names
    copies = {f"nanoslip/study/shipped/campaigns/{name}.toml" for name in campaign_files()}
    beside = (path for kind in ("csv", "py") for path in (ROOT / "campaigns").rglob(f"*.{kind}"))
    copies |= {f"nanoslip/study/shipped/{path.relative_to(ROOT)}" for path in beside}
    copies |= {f"nanoslip/study/shipped/slurm/{name}" for name in ("job.sh.j2", "site.toml")}
    assert {name for name in names - there if not name.startswith(("nanoslip/solver/", "nanoslip/study/"))} == {
        "nanoslip/__init__.py",
        "nanoslip/__main__.py",
        "nanoslip/py.typed",
    }
    assert {name for name in names if name.startswith("nanoslip/study/shipped/")} - {
        "nanoslip/study/shipped/source_commit"
    } == copies


def test_it_installs_one_name(call):
    """Modules of the user's own may be called `solver` and `study`."""
    program = (
        "from importlib.util import find_spec; print([n for n in ('nanoslip', 'solver', 'study') if find_spec(n)])"
    )
    assert call("python", "-c", program) == "['nanoslip']\n"


def test_it_computes_from_an_empty_folder(call, tmp_path):
    (tmp_path / "tiny.toml").write_text(TINY)
    assert "dataset: results/tiny/results.nc" in call("nanoslip", "run", "tiny.toml")
    assert "report: results/tiny/report.html" in call("nanoslip", "report", "tiny.toml")
    with xr.open_dataset(tmp_path / "results" / "tiny" / "results.nc") as found:
        assert set(found.outcome.values.ravel()) == {found.outcome.flag_meanings.split().index("completed")}
        assert found.attrs["nanoslip_version"] == version()
        assert found.attrs["source_commit"] == source_commit()


def test_it_brings_campaigns_and_cluster_settings(call, tmp_path):
    assert "smoke " in call("nanoslip", "campaigns")
    assert "Figure 5" in call("nanoslip", "figure")
    assert "2 cases" in call("nanoslip", "plan", "smoke")
    said = call("nanoslip", "submit", "smoke", "--out", tmp_path / "out")
    assert f"{Path('study') / 'shipped' / 'slurm' / 'site.toml'}; copy the file" in said
    assert "srun --mpi=pmi2" in (tmp_path / "out" / "job.sh").read_text()


def test_it_is_imported_from_where_it_is_installed(call, installed):
    program = (
        "import nanoslip; print(nanoslip.__file__, nanoslip.surface_compliance(nanoslip.Slab(n_x=9)).matrix.shape)"
    )
    path, shape = call("python", "-c", program).split(maxsplit=1)
    assert installed.parent in Path(path).parents
    assert shape == "(18, 18)\n"


def test_type_checkers_see_its_names(call, tmp_path):
    (tmp_path / "mine.py").write_text(
        "import nanoslip\nreveal_type(nanoslip.friction_record(nanoslip.Case()))\n"
        "reveal_type(nanoslip.surface_compliance(nanoslip.Slab()).matrix.ndim)\nreveal_type(nanoslip.open)\n"
    )
    said = call("python", "-m", "mypy", "--strict", "--cache-dir", tmp_path / "cache", "mine.py")
    assert "nanoslip.solver.sliding.record.FrictionRecord" in said
    assert '"int"' in said
    assert "-> xarray" in said
