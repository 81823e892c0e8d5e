"""What one processor computed another one verifies: other kernels of linear algebra, and compiled code without FMA and AVX."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.conftest import clean_environment

CAMPAIGNS = {
    "smoke": """
stages = ["contact", "slip", "dynamics"]
axes.intrinsic_friction = [0.25, 0.5]
constants.radius = 200.0
numerics = {n_x = 65, scheme = "biquadratic"}
ensemble.members = 3
drives = [{name = "paper", duration = 0.2, samples = 100}]
""",
    "strokes": """
axes.spread = [0.0, 0.1]
numerics = {n_x = 33, scheme = "strip"}
constants.radius = 100.0
path = {amplitude = [0.3, 1.0], cycles = 2}
ensemble.members = 3
""",
    "ball": """
stages = ["contact", "slip", "dynamics"]
constants.radius = 50.0
constants.poisson = 0.45
numerics = {n_x = 17, scheme = "half_space"}
limits.events = 200
ensemble.members = 3
drives = [{name = "remembers", duration = 0.05, memory = true, samples = 50}]
""",
    "gradual": """
stages = ["contact", "slip"]
axes.intrinsic_friction = [0.1, 0.3]
constants.radius = 200.0
numerics = {n_x = 33, initial_contact = "gradual"}
limits.events = 200
ensemble.members = 3
""",
}
ARITHMETICS = {
    "SSE2": {"OPENBLAS_CORETYPE": "Prescott"},
    "SSE4.2": {"OPENBLAS_CORETYPE": "Nehalem"},
    "no AVX at all": {"OPENBLAS_CORETYPE": "Nehalem", "NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""},
}
PROGRAM = """
import sys
from nanoslip.study.commands.cli import cli
for words in sys.argv[1:]:
    try:
        cli.main(words.split(), standalone_mode=False)
    except SystemExit as ended:
        if ended.code:
            raise
"""


def commanded(commands: list[str], environment: dict[str, str], folder: Path) -> list[str]:
    """Lines of the output of several commands, in one process."""
    words = [sys.executable, "-c", PROGRAM, *commands]
    done = subprocess.run(words, env=environment, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout.splitlines()


@pytest.fixture(scope="module")
def computed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the datasets of all campaigns, computed as usual."""
    folder = tmp_path_factory.mktemp("computed")
    for name, text in CAMPAIGNS.items():
        (folder / f"{name}.toml").write_text(f'title = "{name}"\n{text}', "utf-8")
    commanded([f"run {name}.toml --serial" for name in CAMPAIGNS], clean_environment(), folder)
    return folder


@pytest.mark.slow
@pytest.mark.parametrize("settings", ARITHMETICS.values(), ids=ARITHMETICS)
def test_what_one_arithmetic_computed_another_one_verifies(computed: Path, settings: dict[str, str]) -> None:
    """As docs/dataset.md promises; a record that takes another way is one within its uncertainties."""
    commands = [f"verify results/{name} --json" for name in CAMPAIGNS]
    said = "\n".join(commanded(commands, clean_environment() | settings, computed))
    decoder, found = json.JSONDecoder(), []
    while said.strip():
        one, end = decoder.raw_decode(said.strip())
        found.append(one)
        said = said.strip()[end:]
    assert len(found) == len(CAMPAIGNS)
    for each in found:
        assert "last bits may differ" in each["other_software"]
        assert each["counts"]["different"] == 0
        assert {case["verdict"] for case in (each["shared"], *each["cases"])} <= {
            "bit-identical",
            "within rounding",
            "within uncertainties",
        }
