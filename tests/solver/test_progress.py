"""Whoever watches a computation hears how far it is, and changes no bit of it."""

from dataclasses import replace

import numpy as np
import pytest

from nanoslip.solver.case import Case, SlipRule
from nanoslip.solver.elasticity.compliance import surface_compliance
from nanoslip.solver.load_path import LoadPath
from nanoslip.solver.progress import part_of_progress, report_progress, watch_progress
from nanoslip.solver.slab import Slab
from nanoslip.solver.sliding import full_contact
from nanoslip.solver.sliding.path import follow
from nanoslip.solver.sliding.slide import slide

CASE = Case(slab=Slab(33), max_events=None, max_presliding=4.0)
COLUMNS = ("displacement", "force_before", "force_after", "stiffness", "dissipated", "node", "slips", "node_slips")


def watched(case):
    """The record of a case, and the shares that it reports."""
    shares = []
    with watch_progress(shares.append):
        record = slide(case, surface_compliance(case.slab))
    return record, shares


@pytest.mark.parametrize(
    "case",
    [
        CASE,
        replace(CASE, max_presliding=None, max_events=700),
        replace(CASE, spacing_events=20_000),
        Case(slab=Slab(17, scheme="half_space"), radius=1.5, normal_load=0.07, max_events=None, max_presliding=2.0),
    ],
    ids=["to a length", "to a number of events", "to two spacings", "a ball"],
)
def test_a_record_in_batches_of_any_size_has_the_same_bits_and_reports_its_way(case, monkeypatch):
    monkeypatch.setattr(full_contact, "REPORTED", 10**12)
    whole, nothing = watched(case)
    monkeypatch.setattr(full_contact, "REPORTED", 500)
    record, shares = watched(case)
    assert nothing == []
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(record, name), getattr(whole, name))
    assert record.final_force == whole.final_force
    assert len(shares) > 5
    assert shares == sorted(shares)
    # Reports are as many events apart as each other, and steady sliding takes as many for each length.
    assert 0.0 < shares[0] <= 0.5
    assert 0.8 < shares[-1] <= 1.0


def test_coulomb_sliding_and_legs_of_a_path_report_theirs():
    coulomb = replace(CASE, slab=Slab(17), slip_rule=SlipRule(residual_shear=1.0), max_presliding=2.0)
    _, shares = watched(coulomb)
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] < 0.5 < shares[-1] <= 1.0
    shares = []
    stroke = replace(coulomb, path=LoadPath(amplitude=0.5, cycles=2))
    with watch_progress(shares.append):
        follow(stroke, surface_compliance(stroke.slab))
    assert shares == sorted(shares)
    assert 0.0 <= shares[0] < 0.3
    assert 0.9 < shares[-1] <= 1.0


def test_parts_count_as_their_shares_of_the_whole_and_nobody_has_to_watch():
    report_progress(0.5)
    shares = []
    with watch_progress(shares.append):
        for number in range(2):
            with part_of_progress(number / 2, (number + 1) / 2):
                report_progress(0.5)
                with part_of_progress(0.5, 1.0):
                    report_progress(0.5)
        report_progress(1.0)
    report_progress(0.1)
    assert shares == [0.25, 0.375, 0.75, 0.875, 1.0]
