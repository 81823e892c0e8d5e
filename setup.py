"""What pyproject.toml cannot say of a wheel: data from folders outside the packages, and the commit it was built from."""

import shutil
import sys
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

ROOT = Path(__file__).resolve().parent
sys.path.insert(0, str(ROOT))

from nanoslip.study.provenance import BUILT_FROM, source_commit  # noqa: E402  the standard library alone
from nanoslip.study.shipped import COPIES, DATA  # noqa: E402


class BuildWithData(build_py):
    """Packages, and beside them copies of the campaigns and cluster settings (see nanoslip.study.shipped)."""

    def run(self) -> None:
        """Build into an empty folder: modules that an earlier build left there would be part of the wheel."""
        if not self.editable_mode:
            shutil.rmtree(self.build_lib, ignore_errors=True)
        super().run()
        if not self.editable_mode:
            self._copy_data(Path(self.build_lib) / "nanoslip" / "study" / COPIES)

    def _copy_data(self, target: Path) -> None:
        for folder, patterns in DATA.items():
            for source in sorted(path for pattern in patterns for path in (ROOT / folder).rglob(pattern)):
                copy = target / source.relative_to(ROOT)
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copyfile(source, copy)
        if (ROOT / ".git").exists():
            (target / BUILT_FROM).write_text(source_commit(ROOT) + "\n", "utf-8")


setup(cmdclass={"build_py": BuildWithData})
