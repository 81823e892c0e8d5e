"""An outcome is one line that can be shown; its advice names nothing that is on already, and what it names helps."""

import pickle
from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, Heterogeneity, SlipRule
from nanoslip.solver.contact.compiled_contact import answer_violations, compile_contact, correct_rounding
from nanoslip.solver.contact.initial import initial_contact
from nanoslip.solver.contact.kernels.state import RESIDUAL_LIMIT, Stop, equilibrium_residual, refresh_response
from nanoslip.solver.contact.soundness import OUTCOME_OF_STOP, advise, energy_created
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.outcome import (
    COMPLETED,
    LONGEST_MESSAGE,
    Ending,
    InvalidInput,
    Outcome,
    SingularOperator,
    printable,
)
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding.plateau import plateau_of
from nanoslip.solver.sliding.slide import slide
from tests.conftest import for_python


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("plain  μ_i = 0.5; needs 1", "plain  μ_i = 0.5; needs 1"),
        ("two\nlines\t", "two lines"),
        ("half \ud800", r"half \ud800"),
        ("\x1b[2J\x07", r"\x1b[2J\x07"),
        ("turned \u202e round", r"turned \u202e round"),
    ],
)
def test_a_message_is_one_line_that_can_be_shown(text, shown):
    assert Outcome(Ending.CRASHED, text).message == shown


def test_outcomes_that_differ_in_values_alone_are_of_one_kind():
    one, other = (InvalidInput("n_x", value, "at least 3").outcome for value in (1, 2))
    assert (one.kind, one.message == other.message) == (other.kind, False)
    assert one.kind != InvalidInput("poisson", 1, "at least 3").outcome.kind
    advised, again = (each.adding(Outcome(Ending.COMPLETED, "raise it")) for each in (one, other))
    assert advised.kind == again.kind != one.kind


@pytest.mark.parametrize("letter", ["x", "\ud800", "μ"])
def test_a_long_message_keeps_its_beginning_and_its_end(letter):
    """Advice stands at the end."""
    message = (
        Outcome(Ending.CRASHED, "why: " + 2_000_000 * letter).adding(Outcome(Ending.COMPLETED, "try again")).message
    )
    assert len(message) <= LONGEST_MESSAGE
    assert message.isprintable()
    assert (message[:5], message[-9:]) == ("why: ", "try again")


@pytest.mark.parametrize("most", [20, 21, 1000])
def test_a_text_too_long_keeps_as_much_of_its_beginning_as_of_its_end_and_its_lines(most):
    text = "".join(chr(ord("a") + number % 26) for number in range(most + 1))
    assert printable(text[:most], most) == text[:most]
    first, last = printable(text, most).split(" ... ")
    assert text.startswith(first)
    assert text.endswith(last)
    assert len(first) + len(last) == most - 5
    assert abs(len(first) - len(last)) <= 1
    assert printable("first\n  \x1b second", 100) == "first\n  \\x1b second"


@pytest.mark.parametrize("scheme", ["galerkin", "biquadratic", "half_plane", "chain"])
@pytest.mark.parametrize("slip_order", ["worst_first", "simultaneous"])
@pytest.mark.parametrize("rough", [False, True])
def test_no_advice_names_what_the_case_does_already(scheme, slip_order, rough):
    pin = Heterogeneity(roughness=((0.0, 0.0), (0.1, 1e-6)) if rough else ())
    case = Case(slab=Slab(17, scheme=scheme), slip_rule=SlipRule(slip_order=slip_order), heterogeneity=pin)
    assert advise(case, COMPLETED) is COMPLETED
    given = [advise(case, outcome).message for outcome in OUTCOME_OF_STOP.values()] + [energy_created(case).message]
    for message in given:
        assert "galerkin" not in message or scheme == "biquadratic"
        assert "worst_first" not in message or slip_order == "simultaneous"
    assert ("smoother" in given[-1]) is rough
    assert any("galerkin" in message for message in given) is (scheme == "biquadratic")


def test_slips_without_end_are_advised_by_their_cause():
    """Without friction on a nearly incompressible slab; each advice but a higher limit is followed here, and helps."""
    slab = Slab(17, poisson=0.4999)
    case = Case(slab=slab, intrinsic_friction=0.0, slip_rule=SlipRule(cascade_limit=3000))
    outcome = initial_contact(case, surface_compliance(slab)).outcome
    assert outcome.ending is Ending.CASCADE_LIMIT
    assert 'initial_contact = "frictionless"' in outcome.message
    assert outcome.message.endswith(", or lower poisson")
    for other in (replace(case, initial_contact="frictionless"), replace(case, slab=replace(slab, poisson=0.3))):
        assert initial_contact(other, surface_compliance(other.slab)).outcome.ok
    with_friction = replace(case, intrinsic_friction=0.5, slab=Slab(17), slip_rule=SlipRule(residual_shear=0.5))
    found = advise(with_friction, OUTCOME_OF_STOP[Stop.CASCADE_LIMIT])
    assert found.message.endswith("lower slip.residual_shear")


def test_operators_without_an_inverse_have_a_cause_for_each_advice() -> None:
    """Lists of failures show one message for each cause, which goes from process to process with the error."""
    outcomes = []
    for poisson in (0.5 - 1e-16, 0.5 - 1e-14, 0.5 - 1e-12, 0.5 - 1e-10):
        with pytest.raises(SingularOperator) as error:
            surface_compliance(Slab(17, poisson=poisson))
        outcomes.append(error.value.outcome)
        assert pickle.loads(pickle.dumps(error.value)).outcome == outcomes[-1]
    first, same, other, alike = outcomes
    assert first.message != same.message
    assert first.kind == same.kind != other.kind == alike.kind


def test_pillars_that_sway_are_to_be_lower():
    case = Case(slab=Slab(17, aspect_ratio=3000.0), intrinsic_friction=0.5, max_events=200)
    record = slide(case, surface_compliance(case.slab))
    assert record.outcome.ending is Ending.SLIP_UNBOUNDED
    assert record.outcome.message.count("an aspect_ratio nearer 1") == 1
    lower = replace(case, slab=replace(case.slab, aspect_ratio=10.0))
    assert slide(lower, surface_compliance(lower.slab)).outcome.ok


@pytest.mark.parametrize(
    ("changed", "cause", "advised"),
    [
        ({"intrinsic_friction": 1e10}, "carried", "intrinsic_friction"),
        ({"normal_load": 1e-13}, "one_node", "raise n_x"),
    ],
)
def test_advice_is_about_the_cause(changed, cause, advised):
    """Friction of 1e10 blamed the pin, a contact of one node the limits of its record."""
    record = slide(
        case := replace(Case(max_presliding=8.0, slab=Slab(n_x=17)), **changed), surface_compliance(case.slab)
    )
    outcome = record.outcome if not record.outcome.ok else plateau_of(record).outcome
    assert outcome.cause == cause
    assert advised in outcome.message


@pytest.fixture
def one_node():
    slab, contact, zero = Slab(n_x=9), np.arange(9) == 4, np.zeros(9)
    return compile_contact(Case(slab=slab), surface_compliance(slab), contact, zero, zero, np.ones(9, dtype=bool))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("entry", [1, 4, 13, 18])
def test_what_is_no_number_is_a_residual_and_ends_a_cascade(one_node, entry, value):
    """In a free node's displacement, a contact node's shear and pressure, and the approach: comparisons do not see it."""
    assert equilibrium_residual(one_node.state) < RESIDUAL_LIMIT
    one_node.state.response[entry] = value
    assert not equilibrium_residual(one_node.state) <= RESIDUAL_LIMIT
    outcome = OUTCOME_OF_STOP[answer_violations(one_node)]
    assert not outcome.ok  # an infinite shear slips, an infinite tension is released: neither gets far
    assert outcome.ending is Ending.ROUNDING or not np.isnan(value)


def test_inputs_that_are_no_numbers_cannot_be_corrected(one_node):
    one_node.state.inputs[4] = np.nan
    for_python(refresh_response)(one_node.state)
    assert OUTCOME_OF_STOP[correct_rounding(one_node, Stop.DONE)].ending is Ending.ROUNDING


def test_a_contact_that_bears_nothing_has_an_infinite_residual(one_node):
    """The largest displacement is what it is compared with: there is none."""
    one_node.state.response[:] = 0.0
    assert equilibrium_residual(one_node.state) == np.inf


def test_every_stop_that_ends_a_run_has_an_outcome():
    """All but the one after which a wider window is set up."""
    assert set(Stop) - set(OUTCOME_OF_STOP) == {Stop.WINDOW_TOO_NARROW}
