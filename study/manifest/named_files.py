"""Read the files that a campaign names: its table of cases, the pin's roughness, a measured front."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

from study.manifest.checker import Checker
from study.manifest.columns import PinProfile, Table, read_profile, read_table, read_text
from study.manifest.problems import ManifestError, shown

Content = TypeVar("Content")


class NamedFiles(Checker):
    """Reads the files that one campaign file names, or takes their texts from `beside`; collects problems."""

    def table(self, top: dict[str, Any]) -> Table | None:
        """The table of cases; None where the campaign names none or it is refused."""
        if "table" not in top:
            return None
        for other in ("axes", "design"):
            if other in top:
                self.refuse(other, f"needs to be left out beside table = {shown(top['table'])}")
        return self._read(read_table, "table", top["table"])

    def profile(self, content: dict[str, Any]) -> PinProfile | None:
        """The pin's roughness; None where the table [heterogeneity] names none or it is refused."""
        name = content.get("roughness")
        if name is None:
            return None
        if not isinstance(name, str):
            self.refuse(f"heterogeneity.roughness = {shown(name)}", "needs the path of a CSV file with xi and height")
            return None
        return self._read(read_profile, "roughness", name)

    def measured(self, key: str, content: dict[str, Any]) -> str | None:
        """The text of a measured front; None where the campaign names none or it is refused."""
        found = self._read(read_text, key, content[key]) if key in content else None
        return found[1] if found else None

    def _read(self, read: Callable[[Path, str | None], Content], key: str, name: str) -> Content | None:
        """What is in the file that a key names, or in its text; None where that is refused."""
        if self.beside is not None and key not in self.beside:
            self.refuse(key, "the text of its file is missing")
            return None
        try:
            return read(self.path.parent / name, self.beside[key] if self.beside is not None else None)
        except ManifestError as error:
            self.problems += error.lines
            return None
