"""Table 6 on a few flights: rows as scripts read them, the same harness for any endpoint."""

import sys
from pathlib import Path

import pytest

from core.experiments import table6
from core.report.endpoint import MODEL, URL
from core.report.metrics import PAPER

sys.path.append(str(Path(__file__).parents[1] / "report"))
from hostile import chat_server, says

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
        assert set(row) == {"writer", "grounded", "ccc", "sec", "dc", "hr", "sd", "paper"}
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
