"""What a diagnosis may know of what was done: repairs and targets, never an injected fault."""

from core.diagnosis.interventions import interventions
from core.fmea.fault import Fault
from core.jobs.worker import fly_run
from core.twin.actions import Repair, SetFault, SetTarget
from core.twin.plan import Plan

ACTIONS = (
    SetFault(40.0, "engine_failure", 0.9),
    Repair(110.0),
    SetTarget(150.0, altitude_ft=5500.0, heading_deg=90.0),
)


def test_an_injected_fault_stays_unknown() -> None:
    known = interventions(ACTIONS)
    assert [(item.time_s, item.kind) for item in known] == [(110.0, "repair"), (150.0, "target")]
    assert known[1].targets == "5,500 ft, heading 90°"
    assert "engine_failure" not in repr(known)


def test_the_report_of_a_repaired_flight_is_of_the_flight_before() -> None:
    """ux.md D4: after the repair it was called cylinder compression, and no word of the repair."""
    result = fly_run("a", Plan(duration_s=240.0), Fault("nominal"), lambda event: None, ACTIONS)
    diagnosis, text = result.diagnosis, result.report.markdown
    assert diagnosis.top == "engine_failure"
    assert diagnosis.judged_until_s == 110.0
    assert max(item.end_s for item in diagnosis.evidence) <= 110.0
    assert "Repaired at 1:50: nothing later is evidence." in text
    assert "New targets for both aircraft at 2:30: 5,500 ft, heading 90°." in text
    assert not [item for item in result.report.sentences if item.checked.struck]
