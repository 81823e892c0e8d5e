"""The effects that a manifest switches on and off."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Final

from nanoslip.solver.case import Effects
from nanoslip.solver.drive import Drive
from nanoslip.solver.parameter import declared
from nanoslip.solver.slab import SCHEMES
from nanoslip.study.manifest.manifest import Manifest
from nanoslip.study.manifest.parameters import Value


def read_effect_switches(manifest: Manifest) -> dict[str, str]:
    """Every effect that a manifest can switch -> its setting here: `on`, `off`, or values that differ from case to case or drive
    to drive."""
    switches = {name: _word(name in manifest.stages) for name in ("slip", "dynamics")}
    switches |= {name: _joint(map(_word, manifest.case_values(name))) for name in declared(Effects)}
    schemes = [SCHEMES[str(scheme)] for scheme in manifest.case_values("scheme")]
    switches["finite slab (scheme)"] = _joint(_word(not scheme.bottomless) for scheme in schemes)
    switches["spread of μ_i"] = _spread(manifest.case_values("spread"))
    switches["load path"] = _word(manifest.paths)
    switches["roughness of the pin"] = _word(any(manifest.case_values("roughness")))
    if not manifest.drives:
        return switches
    drives = [pull.drive.in_si for pull in manifest.drives if pull.drive]
    return switches | {name: _joint(map(setting, drives)) for name, setting in _OF_DRIVES.items()}


_OF_DRIVES: Final[Mapping[str, Callable[[Drive], str]]] = {
    "surface_compliance": lambda drive: _word(drive.surface_compliance),
    "reverse_motion": lambda drive: _word(drive.reverse_motion),
    "damping": lambda drive: _word(drive.damping_ratio > 0.0),
    "sawtooth": lambda drive: "on" if drive.profile == "sawtooth" else f"off: {drive.profile}",
}
"""Effect of a drive -> its setting."""


def _spread(values: Sequence[Value]) -> str:
    different = {float(value) for value in values if value}
    shown = [f"{value:g}" for value in sorted(different)]
    # A design that fills a range has another spread for each case.
    if len(shown) > _MOST:
        shown = [f"{shown[0]} to {shown[-1]}"]
    off = [] if all(values) else ["off"]
    return _joint([*shown, *off])


_MOST: Final = 6
"""Values that are named one by one."""


def _word(on: object) -> str:
    return "on" if on else "off"


def _joint(values: Iterable[str]) -> str:
    return ", ".join(dict.fromkeys(values))
