"""Table 6 on a few flights: rows as scripts read them, the same harness for any endpoint."""

from pathlib import Path
from typing import NoReturn

import pytest
from hostile import chat_server, says

from core.errors import MirrorTwinError
from core.experiments.paper import table6
from core.fmea.fault import Fault
from core.report.check.metrics import PAPER
from core.report.write.endpoint import MODEL, URL
from core.report.write.writers import TemplateWriter

pytestmark = pytest.mark.slow


def test_rows_for_every_writer_raw_and_grounded(monkeypatch: pytest.MonkeyPatch) -> None:
    text = "The engine is fine. The turbocharger failed."
    with chat_server(says({}, default=text)) as server:
        monkeypatch.setenv(URL, server.url)
        monkeypatch.setenv(MODEL, "a-model")
        result = table6.run(quick=True, progress=lambda share: None)
    rows = {(row["writer"], row["grounded"]): row for row in result.findings["rows"]}
    assert set(rows) == {(writer, grounded) for writer in PAPER for grounded in (False, True)}
    for (writer, _), row in rows.items():
        assert set(row) == {"writer", "grounded", "ccc", "sec", "dc", "hr", "runs", "sd", "paper"}
        assert row["paper"] == PAPER[writer].to_dict()
    for writer in PAPER:
        assert rows[writer, True]["ccc"] >= 0.95
        assert rows[writer, True]["hr"] <= 0.02
    assert rows["with_fmea", False]["ccc"] == 0.0
    assert rows["with_fmea", False]["hr"] == 1.0
    assert result.settings["language_model"] == "a-model"
    prompts = [request["messages"][-1]["content"] for request in server.requests]
    assert sum("KNOWLEDGE" in text for text in prompts) == len(prompts) / 2


def test_without_a_model_the_result_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(URL, raising=False)
    monkeypatch.setattr(table6, "model_file", lambda: None)
    result = table6.run(quick=True, progress=lambda share: None)
    assert {row["writer"] for row in result.findings["rows"]} == {"template"}
    assert result.settings["language_model"].startswith("none")


def test_a_report_that_was_measured_is_not_written_again(tmp_path: Path) -> None:
    class Exhausted(TemplateWriter):
        def section(self, case: object, title: str) -> NoReturn:
            raise MirrorTwinError("asked again")

    flight = table6.Flight(table6.TABLE6_SEED, Fault("oil_cooler_maintenance", 0.7, 60.0))
    first = table6._Bench(tmp_path, "a-model", {}).measured(flight, "template", TemplateWriter())
    again = table6._Bench(tmp_path, "a-model", {})
    assert again.measured(flight, "template", Exhausted()) == first
    assert again.is_kept(flight, "template")
    assert not again.is_kept(flight, "with_fmea")
    with pytest.raises(MirrorTwinError, match="asked again"):
        again.measured(table6.Flight(1, flight.fault), "template", Exhausted())


def test_without_time_for_a_model_its_rows_are_null(monkeypatch: pytest.MonkeyPatch) -> None:
    with chat_server(says({}, default="The engine is fine.")) as server:
        monkeypatch.setenv(URL, server.url)
        monkeypatch.setenv(MODEL, "a-model")
        result = table6.run(quick=True, progress=lambda share: None, minutes=0.0)
    rows = {(row["writer"], row["grounded"]): row for row in result.findings["rows"]}
    assert rows["template", True]["runs"] > 0
    assert rows["with_fmea", True]["runs"] == 0
    assert rows["with_fmea", True]["ccc"] is None
