"""The report as the page shows it, and the jobs that write one anew, without a browser."""

import argparse
import asyncio
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from dash._utils import to_json
from hostile import chat_server, hangs_in_the_middle, refuses_the_key, says
from report_samples import diagnosis, evidence

from app.cli.report import configure
from app.kit.nodes import Node
from app.pages.report.panel import report_panel, watched, whole_report
from app.pages.report.text import report_text
from app.report_desk import Job, ReportDesk
from core.errors import MirrorTwinError
from core.fmea.fault import Fault
from core.report.case.case import open_case
from core.report.check.metrics import CHECKED, HOW_CHECKED
from core.report.grounded import Done, GroundedReport, grounded_template, write_grounded
from core.report.sections import SECTION_TITLES
from core.report.write.endpoint import MODEL, URL, Endpoint
from core.report.write.offers import WRITERS, offers
from core.report.write.writers import ModelWriter
from core.store.store import RunStore
from core.twin.plan import Plan

GIVEN = diagnosis(
    {"baffle_crack": 0.9, "baffle_rivet": 0.08, "cylinder_crack": 0.02},
    [evidence("E1 CHT3", 18.34, 70.0, 180.0)],
)
TEMPLATE = grounded_template(open_case(GIVEN))
FALSE = "CHT 3 fell by 300 °F. The <b>turbocharger</b> failed. CHT 3 rose by 18.3 °F."


def written_by(text: str) -> GroundedReport:
    """What a model's text for every section comes to."""
    with chat_server(says({}, default=text)) as server:
        *_, done = write_grounded(open_case(GIVEN), ModelWriter(Endpoint(server.url, "m")))
    assert isinstance(done, Done)
    return done.report


def parts(tree: Any, kind: str) -> Iterator[dict[str, Any]]:
    """The properties of every component of a kind in a tree of plain values."""
    if isinstance(tree, list):
        for item in tree:
            yield from parts(item, kind)
    elif isinstance(tree, dict):
        if tree.get("type") == kind:
            yield tree["props"]
        yield from parts(tree.get("props", tree).get("children"), kind)


def drawn(tree: list[Node]) -> Iterator[tuple[str, dict[str, Any], list[Node]]]:
    """Every element of what the browser draws: its tag, attributes and children."""
    for node in tree:
        if not isinstance(node, str):
            tag, attributes, children = node
            yield tag, attributes, children
            yield from drawn(children)


def plain(components: list[Any]) -> Any:
    """Components as the browser gets them."""
    return json.loads(to_json(components))


def test_the_template_stands_in_sections_lists_and_a_table() -> None:
    tree = plain(report_text(TEMPLATE.sentences, is_trusted=True))
    assert [part["children"] for part in parts(tree, "H2")] == list(SECTION_TITLES)
    assert [part["children"] for part in parts(tree, "Th")][:2] == ["Channel", "Interval"]
    rows = [part for part in parts(tree, "Tr") if part.get("className") == "claim"]
    assert rows[0]["data-verdict"] == "supported"
    assert rows[0]["data-start-s"] == "70.00"
    assert not list(parts(tree, "Del"))
    reached = [part.get("tabIndex") for kind in ("Span", "Tr") for part in parts(tree, kind)]
    assert reached.count(0) == 1


def test_false_sentences_are_struck_with_a_mark_a_reason_and_no_markup() -> None:
    report = written_by(FALSE)
    tree = whole_report("r", report)
    struck = [text for tag, _, text in drawn(tree) if tag == "del"]
    verdicts = [given.get("data-verdict") for tag, given, _ in drawn(tree) if tag == "span"]
    assert len(struck) >= 2
    assert {"supported", "unsupported", "contradicted"} <= set(verdicts)
    assert "The <b>turbocharger</b> failed." in str(struck)
    assert any("nothing in the evidence" in str(text) for tag, _, text in drawn(tree))
    assert any(given.get("class") == "added" for _, given, _ in drawn(tree))


def test_the_report_begins_with_its_text_and_ends_with_how_it_was_checked() -> None:
    tree = whole_report("r", TEMPLATE)
    assert tree[0] == ["h2", {}, ["Conclusion"]]
    (folded,) = [children for tag, _, children in drawn(tree) if tag == "details"]
    assert folded[0] == ["summary", {}, [CHECKED]]
    assert HOW_CHECKED in str(folded)
    names = [children for tag, _, children in drawn(folded) if tag == "dt"]
    assert names[0] == ["Causal chain coverage (CCC), 1 is best"]
    assert len(names) == 4
    helps = {given["title"] for _, given, _ in drawn(tree) if given.get("class") == "mark"}
    assert helps == {"Agrees with the evidence and the FMEA knowledge"}


def test_menu_and_command_line_offer_every_writer_of_the_registry() -> None:
    (choice,) = parts(plain([report_panel()]), "Select")
    parser = argparse.ArgumentParser()
    configure(parser)
    kinds = [row.kind for row in WRITERS]
    assert [each["value"] for each in choice["data"]] == kinds
    assert [parser.parse_args(["r", "--writer", kind]).writer for kind in kinds] == kinds
    assert parser.parse_args(["r"]).writer == choice["value"] == kinds[0]
    assert all(row.help.split("\n")[0] in str(parser.epilog) for row in WRITERS)


def test_a_writer_that_cannot_write_says_why_in_the_menu(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(URL, raising=False)
    panel = plain([report_panel()])
    (choice,) = parts(panel, "Select")
    (missing,) = [each for each in choice["data"] if each["value"] == "model"]
    assert missing["disabled"] and URL in missing["label"]
    assert json.dumps(panel).count(URL) == 1


@pytest.fixture
def stored(tmp_path: Path) -> tuple[RunStore, str]:
    store = RunStore(tmp_path)
    record = store.create(Plan(), Fault("baffle_crack"))
    store.save_result(record.id, GIVEN, TEMPLATE)
    return store, record.id


def outcome(
    store: RunStore, run_id: str, *, stop: bool = False, question: str | None = None
) -> Job:
    """Let the configured endpoint write, watched by a page, until it is over."""

    async def scenario() -> Job:
        desk = ReportDesk(store)
        desk.begin(run_id, "model", question)
        with pytest.raises(MirrorTwinError, match="still writing"):
            desk.begin(run_id, "template")
        async with asyncio.timeout(30):
            async for job in desk.watch(run_id, 60.0):
                assert job is not None
                watched(job, TEMPLATE)
                if stop and job.draft[1]:
                    desk.stop(run_id)
                if job.over:
                    return job
        raise AssertionError

    return asyncio.run(scenario())


def test_a_report_written_anew_is_kept(
    stored: tuple[RunStore, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    with chat_server(says({}, default=FALSE)) as server:
        monkeypatch.setenv(URL, server.url)
        monkeypatch.setenv(MODEL, "a-model")
        job = outcome(*stored)
        answered = outcome(*stored, question="how sure is it?")
    store, run_id = stored
    assert job.outcome is not None
    assert store.load_result(run_id)[1] == job.outcome
    assert job.outcome.writer == "a-model"
    report, _, status = watched(job, TEMPLATE)
    assert "Written by a-model" in to_json(report)
    assert status == ""
    assert "how sure is it?" in to_json(watched(answered, TEMPLATE)[1])


def test_a_stopped_or_refused_writer_leaves_a_whole_report(
    stored: tuple[RunStore, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    store, run_id = stored
    monkeypatch.setenv(MODEL, "a-model")
    with chat_server(hangs_in_the_middle) as server:
        monkeypatch.setenv(URL, server.url)
        job = outcome(store, run_id, stop=True)
    report, _, status = watched(job, TEMPLATE)
    assert to_json(report) == to_json(whole_report(run_id, TEMPLATE))
    assert "was stopped" in status
    assert store.load_result(run_id)[1] == TEMPLATE
    with chat_server(refuses_the_key) as server:
        monkeypatch.setenv(URL, server.url)
        job = outcome(store, run_id)
    assert job.outcome is not None
    assert job.outcome.final.ccc == 1.0
    assert "rejected the API key" in to_json(watched(job, TEMPLATE)[0])


def test_who_cannot_write_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(URL, raising=False)
    by_kind = {offer.kind: offer for offer in offers()}
    assert by_kind["template"].problem is None
    assert URL in (by_kind["model"].problem or "")
    monkeypatch.setenv(URL, "ftp://x")
    assert "address" in (next(o for o in offers() if o.kind == "model").problem or "")

    async def begin(kind: str) -> None:
        ReportDesk(RunStore(tmp_path)).begin("r", kind)

    monkeypatch.delenv(URL)
    for kind, told in (("model", URL), ("nobody", "must be template, model or local")):
        with pytest.raises(MirrorTwinError, match=told):
            asyncio.run(begin(kind))
