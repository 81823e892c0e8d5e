"""Read the files that a campaign names: its table of cases, the pin's roughness, a measured front, measured influences."""

from typing import Any

from study.manifest.checker import Checker
from study.manifest.columns import PinProfile, Table, read_profile, read_table, read_text
from study.manifest.problems import ManifestError, shown


class NamedFiles(Checker):
    """Reads the files that one campaign file names, or takes their texts from `beside`; collects problems."""

    def table(self, top: dict[str, Any]) -> Table | None:
        """The table of cases; None where the campaign names none or it is refused."""
        if "table" not in top:
            return None
        for other in ("axes", "design"):
            if other in top:
                self.refuse(other, f"needs to be left out beside table = {shown(top['table'])}")
        try:
            return read_table(self.path.parent / top["table"], self._given("table"))
        except ManifestError as error:
            self.problems += error.lines
            return None

    def profile(self, content: dict[str, Any]) -> PinProfile | None:
        """The pin's roughness; None where the table [heterogeneity] names none or it is refused."""
        name = content.get("roughness")
        if name is None:
            return None
        if not isinstance(name, str):
            self.refuse(f"heterogeneity.roughness = {shown(name)}", "needs the path of a CSV file with xi and height")
            return None
        try:
            return read_profile(self.path.parent / name, self._given("roughness"))
        except ManifestError as error:
            self.problems += error.lines
            return None

    def measured(self, key: str, content: dict[str, Any]) -> str | None:
        """The text of a measured front, or of measured influences; None where the campaign names none or it is refused."""
        if key not in content:
            return None
        try:
            given = self._given(key)
            return read_text(self.path.parent / content[key])[1] if given is None else given
        except ManifestError as error:
            self.problems += error.lines
            return None

    def _given(self, key: str) -> str | None:
        """The text of the file that a key names; None where files are read. Raises ManifestError where it is missing."""
        if self.beside is None:
            return None
        if key not in self.beside:
            raise ManifestError([f"{self.path}: {key}: the text of its file is missing"])
        return self.beside[key]
