"""The knowledge base against the twin: what a mode is said to do is what it does in flight."""

import pytest
from report_samples import diagnosis

from core.diagnosis.evidence import find_evidence
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.knowledge.knowledge import knowledge
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.twin.flight import fly_pair
from core.twin.plan import Plan

FAULTS = [mode for mode in catalogue() if mode != "nominal"]


@pytest.mark.parametrize("mode", FAULTS)
def test_a_flown_fault_bears_out_its_chain(mode: str) -> None:
    fault = Fault(mode, severity=0.8, onset_s=60.0)
    items, onset_s = find_evidence(fly_pair(Plan.sampled(2026), fault))
    given = diagnosis({mode: 0.95}, items, onset_s=onset_s)
    finding = open_case(given).top.finding
    assert 2 * len(finding.confirmed) >= len(finding.predicted)
    assert [check.channel for check in finding.having("conflicts")] == []
    assert "Contradicted" not in grounded_template(open_case(given)).markdown
    hit = open_case(given).hit
    if knowledge()[mode].names_cylinder:
        assert hit is not None
        bank = {fault.target_cylinder}
        if mode == "baffle_tie_rod":
            bank |= {{1: 3, 3: 1, 2: 4, 4: 2}[fault.target_cylinder]}
        assert hit.cylinder in bank


def test_a_flown_healthy_flight_leaves_nothing_to_explain() -> None:
    items, onset_s = find_evidence(fly_pair(Plan.sampled(2026), Fault("nominal")))
    assert (items, onset_s) == ((), None)
    assert (
        "**No fault found.**" in grounded_template(open_case(diagnosis({"nominal": 0.98}))).markdown
    )
