"""The offline report: what it says, what it must never say, and how fast."""

import json
import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from report_samples import any_diagnosis, diagnosis, evidence, ideal_evidence, section_texts

from core.clock import clock
from core.cylinders import CYLINDERS
from core.diagnosis.diagnosis import Diagnosis
from core.errors import InputError
from core.fmea.catalogue import class_ids
from core.knowledge.knowledge import knowledge
from core.report.case.case import open_case
from core.report.case.wording import interval, label, shift, sigma, with_cylinder
from core.report.grounded import GroundedReport, grounded_template
from core.report.sections import SECTION_TITLES
from core.units import percent

FAULTS = [mode for mode in class_ids() if mode != "nominal"]
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e-?\d+)?")
COUNTS = {str(count) for count in range(31)}
"""List numbers, counts of channels and cylinder numbers."""


def write_report(given: Diagnosis) -> GroundedReport:
    return grounded_template(open_case(given))


def numbers(texts: Iterable[str]) -> set[str]:
    return {number for text in texts for number in NUMBER.findall(text)}


def known_numbers(given: Diagnosis) -> set[str]:
    """Every number that the diagnosis or the knowledge base can account for."""
    texts = [given.model]
    for mode in knowledge().values():
        known = [mode.summary, mode.mechanism, mode.ata, mode.records, *mode.actions]
        known += [step.text for step in mode.chain] + [item.tell for item in mode.look_alikes]
        known += [f"{abs(item.low):g} {abs(item.high):g}" for item in mode.channels]
        known += [f"{mode.severity} {mode.occurrence} {mode.detection} {mode.rpn}"]
        known += [percent(share) for share in mode.cylinder_share]
        texts += known
    for item in given.evidence:
        texts += [shift(item), sigma(item.sigma), interval(item), clock(item.onset_s)]
    texts += [clock(float(end)) for end in given.time_s]
    texts += [percent(float(p)) for p in given.probabilities]
    if given.onset_s is not None:
        texts.append(clock(given.onset_s))
    odds = sorted(map(float, given.probabilities), reverse=True)
    texts.append(f"{min(99, round(100 * (odds[0] - odds[1])))}")
    return numbers(texts) | COUNTS


@settings(deadline=None)
@given(any_diagnosis())
def test_any_diagnosis_gives_five_sections_of_plain_markdown(given: Diagnosis) -> None:
    report = write_report(given)
    assert report.is_trusted
    assert all(section_texts(report).values())
    assert all(item.kept for item in report.sentences)
    assert [line for line in report.markdown.splitlines() if line.startswith("#")] == [
        f"## {title}" for title in SECTION_TITLES
    ]
    assert not re.search(r"(?<!\\)<(?! \d)", report.markdown)
    assert GroundedReport.from_dict(json.loads(json.dumps(report.to_dict()))) == report


@settings(deadline=None)
@given(any_diagnosis())
def test_every_number_is_accounted_for(given: Diagnosis) -> None:
    assert numbers([write_report(given).markdown]) - known_numbers(given) == set()


@settings(deadline=None)
@given(any_diagnosis())
def test_every_item_of_evidence_is_cross_checked(given: Diagnosis) -> None:
    rows = section_texts(write_report(given))["Evidence cross-check"]
    for item in given.evidence:
        row = f"| {label(item.channel)} | {interval(item)} | {shift(item)} | {sigma(item.sigma)} |"
        verdict = rows[rows.index(row) + len(row) :].split()[0]
        assert verdict.strip(":,") in ("agrees", "right", "conflicts", "unexplained")


@settings(deadline=None)
@given(any_diagnosis())
def test_the_candidates_are_weighed_in_order(given: Diagnosis) -> None:
    text = section_texts(write_report(given))
    names = [knowledge()[mode].name for mode, _ in given.ranked(3)]
    listed = re.findall(r"^\d\. (.+): [<>]? ?\d+\.\d %$", text["Conclusion"], re.MULTILINE)
    assert listed == names
    rivals = re.findall(r"^- \*\*(.+)\*\* \(", text["Differential diagnosis"], re.MULTILINE)
    assert rivals[:2] == names[1:]
    assert len(rivals) == len(set(rivals))
    alike = [knowledge()[item.mode].name for item in knowledge()[given.top].look_alikes]
    assert set(alike) <= set(rivals)


@pytest.mark.parametrize("cylinder", CYLINDERS)
@pytest.mark.parametrize("mode", FAULTS)
def test_a_textbook_case_is_told_plainly(mode: str, cylinder: int) -> None:
    known = knowledge()[mode]
    report = write_report(diagnosis({mode: 0.97}, ideal_evidence(mode, cylinder)))
    text = section_texts(report)
    assert text["Conclusion"].startswith(f"**{known.name}")
    assert "**Confidence: high.**" in text["Conclusion"]
    assert text["Mechanism"].count("**Seen.**") == sum(bool(step.channels) for step in known.chain)
    assert "Not seen" not in text["Mechanism"] and "Contradicted" not in text["Mechanism"]
    assert "conflicts" not in text["Evidence cross-check"]
    assert "**Missing:**" not in text["Evidence cross-check"]
    if known.names_cylinder and mode != "baffle_tie_rod":
        assert f"at cylinder {cylinder} (" in text["Conclusion"]
        assert "the affected cylinder" not in report.markdown
    if mode == "baffle_tie_rod":
        bank = "right" if cylinder in (1, 3) else "left"
        assert f"{bank} bank" in text["Conclusion"]
    for number, action in enumerate(known.actions, start=1):
        named = with_cylinder(action, cylinder) if known.names_cylinder else action
        if mode != "baffle_tie_rod":
            assert f"{number}. {named}" in text["Maintenance"]


def test_what_should_be_there_and_is_not_is_said() -> None:
    hot_oil = [evidence("E1 OilT", 20.0)]
    text = section_texts(write_report(diagnosis({"oil_cooler_maintenance": 0.95}, hot_oil)))
    rows = text["Evidence cross-check"]
    assert "**Missing:** Oil pressure should fall by 1.3 to 6 psi but stayed within noise." in rows
    assert "**Missing:** CHT 1-4 should rise by 1.5 to 5 °F but stayed within noise." in rows
    assert "**Quiet, as it should be:** Fuel flow, Engine speed, EGT 1-4" in rows
    assert text["Mechanism"].count("**Not seen.**") == 2
    assert "**Confidence: low.** " in text["Conclusion"]
    assert "Expected shifts found: 1 of 6." in text["Conclusion"]


def test_evidence_against_the_verdict_is_said_in_three_places() -> None:
    items = [evidence("E1 OilT", -20.0), evidence("volt1", -3.0)]
    text = section_texts(write_report(diagnosis({"oil_cooler_maintenance": 0.95}, items)))
    assert "The evidence does not fit in Oil temperature" in text["Conclusion"]
    assert "**Contradicted by evidence.** Cooler efficiency" in text["Mechanism"]
    assert "conflicts: should rise by 13 to 45 °F" in text["Evidence cross-check"]
    assert "| Main bus | 1:10-3:00 | -3.0 V | 111 σ | unexplained" in text["Evidence cross-check"]


def test_a_close_call_is_left_open_and_both_are_acted_on() -> None:
    items = [evidence("E1 CHT3", 5.0)]
    given = diagnosis({"baffle_screw": 0.5, "baffle_plug": 0.45}, items)
    text = section_texts(write_report(given))
    assert text["Conclusion"].startswith("**Open between Baffle screw and Baffle plug.**")
    assert "**Confidence: low.**" in text["Conclusion"]
    assert "5 points ahead of Baffle plug" in text["Conclusion"]
    for mode in ("baffle_screw", "baffle_plug"):
        for action in knowledge()[mode].actions:
            assert with_cylinder(action, 3) in text["Maintenance"]


def test_a_rival_that_explains_more_is_named() -> None:
    """The oil of a cooler, called a seal: the same signs, but the heads hardly moved."""
    items = ideal_evidence("oil_cooler_maintenance", 1)
    given = diagnosis({"baffle_seal": 0.7, "oil_cooler_maintenance": 0.3}, items)
    text = section_texts(write_report(given))
    assert "Oil cooler maintenance would explain all of the evidence" in text["Conclusion"]
    assert "for Oil cooler maintenance:" in text["Maintenance"]
    assert "with a cooler, about ten times" in text["Differential diagnosis"]


def test_a_verdict_without_evidence_is_hedged() -> None:
    text = section_texts(write_report(diagnosis({"baffle_screw": 0.99}, onset_s=None)))
    assert "nothing measured supports this verdict" in text["Conclusion"]
    assert "**Confidence: low.**" in text["Conclusion"]
    assert "records favour cylinder 3 (right rear) with 83.0 %" in text["Conclusion"]
    assert "No onset" in text["Conclusion"]
    assert "No channel left its noise" in text["Evidence cross-check"]
    assert "the affected cylinder" in text["Maintenance"]


def test_a_healthy_flight_is_no_guarantee() -> None:
    report = write_report(diagnosis({"nominal": 0.98}, onset_s=None))
    text = section_texts(report)
    assert text["Conclusion"].startswith("**No fault found.**")
    assert "too small or too slow for these sensors" in text["Conclusion"]
    assert "Contradicted" not in text["Mechanism"]
    assert "Engine requires maintenance" in text["Differential diagnosis"]
    assert "No corrective action" in text["Maintenance"]


def test_a_nominal_verdict_against_the_evidence_is_not_believed() -> None:
    given = diagnosis({"nominal": 0.8, "baffle_plug": 0.2}, [evidence("E1 CHT3", 3.5)])
    text = section_texts(write_report(given))
    assert text["Conclusion"].startswith("**Nominal by the classifier, but not by the evidence.**")
    assert "**Confidence: low.**" in text["Conclusion"]
    assert "No corrective action" not in text["Maintenance"]
    assert "For Baffle plug:" in text["Maintenance"]


def test_a_healthy_field_flight_may_drift_by_a_trace() -> None:
    given = diagnosis({"nominal": 0.95}, [evidence("E1 CHT3", 3.5)], conditions="field")
    assert section_texts(write_report(given))["Conclusion"].startswith("**No fault found.**")


def test_the_report_says_since_when_the_verdict_stands() -> None:
    wavering = ["nominal", "baffle_screw", "baffle_plug", "baffle_plug"]
    given = diagnosis({"baffle_plug": 0.9}, window_tops=wavering)
    assert "Every window ending at 0:40 or later names it." in write_report(given).markdown
    lost = diagnosis({"baffle_plug": 0.9}, window_tops=["baffle_plug", "nominal"])
    said = "Of 2 windows after the onset 1 name Nominal instead of it, the first ending at 0:35."
    assert said in write_report(lost).markdown


def test_a_hostile_name_stays_text() -> None:
    name = "<script>alert(1)</script>\n\n## Maintenance\n\n| a | `b` | [c](d) ![e](f) *g*"
    report = write_report(diagnosis({"nominal": 1.0}, model=name))
    assert r"\<script\>" in report.markdown
    assert report.markdown.count("\n## ") == len(SECTION_TITLES) - 1
    assert r"\[c\](d)" in report.markdown


@pytest.mark.parametrize(
    ("broken", "field"),
    [
        ({"classes": ("nominal", "propeller_loss"), "probabilities": np.zeros(2)}, "classes"),
        ({"probabilities": np.full(len(class_ids()), np.nan)}, "probabilities"),
        ({"probabilities": np.full(len(class_ids()), -0.1)}, "probabilities"),
        ({"probabilities": np.zeros(len(class_ids()) - 1)}, "probabilities"),
        ({"classes": (), "probabilities": np.zeros(0)}, "probabilities"),
        ({"evidence": (replace(evidence("IAS", 1.0), channel="E2 RPM"),)}, "evidence"),
        ({"evidence": (replace(evidence("IAS", 1.0), value=float("nan")),)}, "evidence"),
        ({"evidence": (replace(evidence("IAS", 1.0), end_s=float("inf")),)}, "evidence"),
        ({"onset_s": float("nan")}, "onset_s"),
    ],
)
def test_a_malformed_diagnosis_is_refused_by_field(broken: dict[str, object], field: str) -> None:
    given = replace(diagnosis({"nominal": 1.0}), **broken)  # type: ignore[arg-type]
    with pytest.raises(InputError) as refusal:
        write_report(given)
    assert refusal.value.field == field
