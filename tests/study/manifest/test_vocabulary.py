"""Words of the field lead to one key each, and words of physics beyond the model to the tool that has it."""

import re
from pathlib import Path

import pytest

from nanoslip.solver.drive import Scales
from nanoslip.solver.parameter import declared
from nanoslip.study.manifest.cases import tables
from nanoslip.study.manifest.parameters import YOUNG
from nanoslip.study.manifest.problems import key_shown, unknown
from nanoslip.study.manifest.vocabulary import BEYOND, MEANT, OTHERWISE, missing_physics, otherwise
from tests.conftest import Main

KEYS = {key for keys in tables().values() for key in keys} | {*declared(Scales), YOUNG}


def test_every_word_is_no_key_and_leads_to_one_that_is() -> None:
    pairs = (*OTHERWISE.values(), *BEYOND.values())
    words = [word for line in (*MEANT.values(), *(line for line, _ in pairs)) for word in line.split()]
    assert len(words) == len({*words})
    assert {*MEANT, *OTHERWISE} <= KEYS
    assert {*words} & KEYS == {"load"}  # a path's key is a list, the load on a pin is not


@pytest.mark.parametrize(
    ("word", "key"),
    [
        ("thickness", "aspect_ratio"),
        ("youngs_modulus", "young_modulus"),
        ("normal_force", "normal_load"),
        ("E", "young_modulus"),
        ("Speed", "stage_velocity"),
        ("width", "slab_width"),
    ],
)
def test_a_word_of_the_field_leads_to_one_key(main: Main, word: str, key: str) -> None:
    code, _, errors = main("try", f"{word}=1")
    assert (code, errors) == (2, f"Error: {word} = 1: unknown; did you mean {key}?\n")
    assert unknown(word, ("radius",)).startswith(f"unknown; did you mean {key}, which belongs in [")


def test_a_load_that_is_no_list_leads_to_the_load_on_the_pin(main: Main, tmp_path: Path) -> None:
    assert "normal_load" in main("try", "load=1 N")[2]
    (tmp_path / "load.toml").write_text('title = "a load"\n[constants]\nload = 1.0\n')
    assert re.search(
        r"constants\.load = 1\.0: belongs in \[path\].* normal_load", main("check", tmp_path / "load.toml")[2]
    )


@pytest.mark.parametrize(
    ("word", "key"),
    [
        ("static_friction", "intrinsic_friction"),
        ("mu_s", "intrinsic_friction"),
        ("μ_k", "intrinsic_friction"),
        ("friction_coefficient", "intrinsic_friction"),
        ("Diameter", "radius"),
        ("tangential_force", "spring_stiffness"),
        ("youngs_modulus_2", "young_modulus"),
        ("angle", "roughness"),
    ],
)
def test_another_quantity_is_not_taken_for_the_key_that_follows_from_it(main: Main, word: str, key: str) -> None:
    """Half of the diameter is the radius; a friction coefficient is a result, about half of μ_i; the pin is rigid."""
    code, _, errors = main("try", f"{word}=0.3")
    assert (code, errors) == (2, f"Error: {key_shown(word)} = 0.3: {otherwise(word)}\n")
    assert key in otherwise(word)
    assert "did you mean" not in errors


@pytest.mark.parametrize("word", ["lugre", "dahl", "bristle_stiffness", "stribeck_velocity", "sigma_0", "σ_0", "d_c"])
def test_words_of_friction_laws_lead_to_what_has_them(main: Main, word: str) -> None:
    code, _, errors = main("try", f"{word}=1")
    assert (code, errors) == (2, f"Error: {key_shown(word)} = 1: {missing_physics(word)}\n")


@pytest.mark.parametrize("word", ["rate", "ageing", "adhesion", "wear", "viscosity"])
def test_a_word_of_other_physics_names_what_has_it(main: Main, word: str) -> None:
    assert "not modelled here; " in missing_physics(word)
    code, _, errors = main("try", f"{word}=1")
    assert (code, errors) == (2, f"Error: {key_shown(word)} = 1: {missing_physics(word)}\n")
