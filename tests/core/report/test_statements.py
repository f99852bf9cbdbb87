"""Reports as statements: true by construction, rendered without being read, and stored for good."""

import json
from dataclasses import replace
from pathlib import Path

import pytest
from report_samples import diagnosis, evidence, ideal_evidence, rechecked

from core.diagnosis.diagnosis import Diagnosis, Intervention
from core.fmea.catalogue import class_ids
from core.knowledge.knowledge import knowledge
from core.report.blocks import Listing, Table, blocks
from core.report.case.case import Case, open_case
from core.report.check.metrics import measure
from core.report.grounded import GroundedReport, grounded_template
from core.report.sections import SECTIONS, Content, supplement
from core.report.statement import Run, inline, lines

STORED = json.loads(
    Path(__file__).with_name("stored_before_statements.json").read_text(encoding="utf-8")
)
"""A report as the version before statements stored it, with its Markdown."""

NOTHING = Content(False, frozenset(), frozenset(), "", frozenset())

DONE = (
    Intervention(95.0, "target", "5,000 ft"),
    Intervention(150.0, "repair"),
    Intervention(170.0, "ground"),
)


def case_of(mode: str) -> Case:
    items = ideal_evidence(mode, 3) if mode != "nominal" else ()
    return open_case(diagnosis({mode: 0.97}, items))


def unusual() -> list[Diagnosis]:
    """Diagnoses that make the template say what a textbook case does not."""
    warm = [evidence("E1 CHT3", 5.0), evidence("volt1", -3.0)]
    close = diagnosis({"baffle_screw": 0.5, "baffle_plug": 0.45}, warm)
    return [
        close,
        replace(close, none_of_these=True),
        replace(close, interventions=DONE),
        diagnosis({"nominal": 0.8, "baffle_plug": 0.2}, warm),
        diagnosis({"nominal": 0.9}, onset_s=None),
        diagnosis({"baffle_screw": 0.99}, onset_s=None, conditions="field"),
        diagnosis({"baffle_plug": 0.9}, warm, window_tops=["baffle_plug", "nominal"]),
        diagnosis({"baffle_plug": 0.9}, [evidence("E1 CHT3", 5.0, 3700.0, 4100.0)], onset_s=3661.0),
    ]


@pytest.mark.parametrize("given", unusual())
def test_the_checker_agrees_with_every_statement(given: Diagnosis) -> None:
    struck = [item for item in rechecked(open_case(given)) if item.struck]
    assert [(item.text, item.reasons) for item in struck] == []


@pytest.mark.parametrize("mode", class_ids())
def test_the_measures_are_those_that_the_checker_finds(mode: str) -> None:
    case = case_of(mode)
    report = grounded_template(case)
    assert report.raw == report.final == measure(case, rechecked(case))


@pytest.mark.parametrize("mode", class_ids())
def test_a_statement_keeps_its_facts(mode: str) -> None:
    """The steps of the chain, the evidence, the actions: each once, by number or channel."""
    case, known = case_of(mode), knowledge()[mode]
    written = [statement for section in SECTIONS for statement in section.write(case)]
    steps = {item.step for item in written if item.kind == "step"}
    actions = [line[0].step for line in lines(written) if line[0].kind == "action"]
    rows = [item.channels[0] for item in written if item.kind == "evidence"]
    assert steps == set(range(1, len(known.chain) + 1))
    assert actions == list(range(1, len(known.actions) + 1))
    assert sorted(rows) == sorted(item.channel for item in case.evidence)


def test_what_a_section_lacks_is_what_it_does_not_state() -> None:
    case = case_of("oil_cooler_maintenance")
    by_id = {section.id: section for section in SECTIONS}
    chain = frozenset(range(1, len(case.top.mode.chain) + 1))

    def added(section_id: str, content: Content) -> list[str]:
        section = next(item for item in by_id.values() if item.id == section_id)
        return [statement.kind for statement in supplement(case, section, content)]

    assert set(added("mechanism", NOTHING)) == {"step"}
    assert {item.step for item in supplement(case, by_id["mechanism"], NOTHING)} == chain
    assert added("mechanism", replace(NOTHING, steps=chain)) == []
    assert set(added("conclusion", replace(NOTHING, concludes=True))) == {"confidence"}
    assert added("conclusion", NOTHING)[0] == "verdict"
    cited = frozenset(item.channel for item in case.evidence)
    assert "evidence" not in added("cross_check", replace(NOTHING, channels=cited))
    assert "evidence" in added("cross_check", replace(NOTHING, channels=cited - {"E1 OilT"}))
    named = replace(NOTHING, text=" ".join(item.name for item in knowledge().values()).casefold())
    assert added("differential", named) == []


def test_a_report_of_the_version_before_statements_still_opens() -> None:
    report = GroundedReport.from_dict(STORED["report"])
    assert report.markdown == STORED["markdown"]
    tables = [block for block in blocks(report.section("Evidence cross-check"))
              if isinstance(block, Table)]  # fmt: skip
    assert {len(row.checked.cells) for table in tables for row in table.rows} == {5}
    assert any(not item.kept for item in report.sentences)
    assert GroundedReport.from_dict(json.loads(json.dumps(report.to_dict()))) == report


def test_lists_lie_below_the_item_they_belong_to() -> None:
    report = grounded_template(case_of("baffle_crack"))
    (rivals,) = blocks(report.section("Differential diagnosis"))
    assert isinstance(rivals, Listing) and not rivals.is_numbered
    assert all(len(item.below) == 1 for item in rivals.items)
    steps = blocks(report.section("Mechanism"))[-1]
    assert isinstance(steps, Listing) and steps.is_numbered
    assert [item.number for item in steps.items] == list(range(1, len(steps.items) + 1))


def test_a_models_emphasis_is_style_and_all_else_is_text() -> None:
    assert inline("The **turbo** `x` <b>failed</b>") == (
        Run("The "), Run("turbo", "strong"), Run(" "), Run("x", "code"), Run(" <b>failed</b>"),
    )  # fmt: skip
