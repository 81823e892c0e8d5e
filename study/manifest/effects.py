"""The effects that a manifest switches on and off: what is left out where one is off, and combinations that are refused."""

from collections.abc import Sequence
from typing import Final, NamedTuple

from nanoslip.solver.case import Case, Effects
from nanoslip.solver.elasticity.grid_scheme import GridScheme
from nanoslip.solver.slab import SCHEMES, Slab
from nanoslip.study.manifest.drives import NamedDrive
from nanoslip.study.manifest.manifest import Manifest


def refusal(manifest: Manifest, case: Case) -> str:
    """The reason why a case is refused with the stages and outputs of its manifest; empty where it is not."""
    if "slip" in manifest.stages and not case.effects.friction:
        return 'friction = false: needs stages = ["contact"], as without friction there is nothing to slide against (F = 0)'
    if manifest.outputs.subsurface and not isinstance(case.slab.scheme, GridScheme):
        return f"subsurface = true with scheme = {case.slab.scheme}: needs a scheme that has a grid, others are a surface only"
    return ""


class Effect(NamedTuple):
    """One effect in a manifest: its name, its setting, and what is left out where it is off."""

    name: str
    setting: str
    """`on`, `off`, or the values where they differ from case to case or from drive to drive."""
    without: str


def effects(manifest: Manifest) -> tuple[Effect, ...]:
    """Every effect that a manifest can switch, with the setting that this one has."""
    stages, outputs = manifest.stages, manifest.outputs
    found = [
        Effect("slip", _word("slip" in stages), "no friction record: nothing slides"),
        Effect("dynamics", _word("dynamics" in stages), "Eq. 12 is not integrated"),
        *(Effect(name, _setting(manifest, name), without) for name, without in _OF_CASES.items()),
    ]
    schemes = manifest.axes.get("scheme", (manifest.fixed.get("scheme", Slab().scheme.name),))
    kinds = [SCHEMES[str(scheme)] for scheme in schemes]
    finite = [_word(kind.continuum and not kind.endless) for kind in kinds]
    without = "half_plane: closed form, no grid, no sides, no bottom; chain: blocks on springs, no slab at all"
    found.append(Effect("finite slab (scheme)", _joint(finite), without))
    found.append(Effect("spread of μ_i", _spread(manifest), "one μ_i for all nodes, nothing is drawn"))
    rough = bool(manifest.fixed.get("roughness"))
    found.append(Effect("roughness of the pin", _word(rough), "a smooth pin, whose height a slip takes in closed form"))
    for name, without in _OF_DRIVES.items() if manifest.drives else ():
        values = [_drive_setting(each.drive, name) for each in manifest.drives if each.drive]
        found.append(Effect(name, _joint(values), without))
    for name, without in _OF_OUTPUTS.items():
        if name not in ("trajectory", "phases", "fit") or manifest.drives:
            found.append(Effect(f"outputs.{name}", _word(bool(getattr(outputs, name))), without))
    return tuple(found)


_OF_CASES = {
    "friction": "no shear: half of the compliance is not read",
    "coupling": "shear and pressure do not act on each other; initial contact is the normal problem alone",
    "pin_translation": "pressures stay those of initial contact: no touch, no release, a slip is a row of the tangential tableau",
}
_OF_DRIVES = {
    "surface_compliance": "rigid stick (K → ∞), no hysteresis",
    "reverse_motion": "no negative branch of Eq. 13: a drive that would slip back ends",
    "damping": "no damper",
    "sawtooth": "no teeth: lines, or one mean force",
}
_OF_OUTPUTS = {
    "records": "friction records are not kept once their drives are done",
    "statistics": "sizes of events are not fitted",
    "trajectory": "no motion over time",
    "phases": "no start and end of macroscopic slips",
    "fit": "Eq. 16-19 are not fitted to the spring force",
    "tractions": "no tractions after initial contact",
    "tractions_at": "no tractions after chosen events",
    "subsurface": "nothing is solved for inside the slab",
}


def _setting(manifest: Manifest, name: str) -> str:
    default = getattr(Effects(), name)
    return _joint([_word(bool(value)) for value in manifest.axes.get(name, (manifest.fixed.get(name, default),))])


def _spread(manifest: Manifest) -> str:
    values = manifest.axes.get("spread", (manifest.fixed.get("spread", 0.0),))
    there = sorted({float(str(value)) for value in values if value})
    shown = [f"{value:g}" for value in there]
    if len(there) > _MOST:
        shown = [f"{shown[0]} to {shown[-1]}"]
    return _joint([*shown, *([] if all(values) else ["off"])])


_MOST: Final = 6
"""Values that are named one by one."""


def _drive_setting(drive: NamedDrive, name: str) -> str:
    if name == "damping":
        return _word(drive.in_si.damping_ratio > 0.0)
    if name == "sawtooth":
        return "on" if drive.in_si.profile == "sawtooth" else f"off: {drive.in_si.profile}"
    return _word(bool(getattr(drive.in_si, name)))


def _word(on: bool) -> str:
    return "on" if on else "off"


def _joint(values: Sequence[str]) -> str:
    return ", ".join(dict.fromkeys(values))
