"""``mirrortwin report``: from a folder or a run to a checked report in a file."""

import json

import pytest

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def flight(tmp_path_factory):
    from app.cli import main

    folder = tmp_path_factory.mktemp("report") / "flight"
    options = ["--fault", "oil_cooler_maintenance", "--severity", "0.8", "--seed", "21"]
    assert main(["simulate", *options, "--out", str(folder)]) == 0
    return folder


def test_markdown_on_the_terminal(mirrortwin, flight):
    done = mirrortwin("report", str(flight))
    assert done.returncode == 0
    assert done.stdout.startswith("# Diagnostic report")
    assert "Simulated flight" in done.stdout
    assert "## Maintenance" in done.stdout
    name = "Oil cooler maintenance"
    assert f"Injected: {name}. Diagnosed: {name}. ✓ right" in done.stdout


def test_html_in_a_file(mirrortwin, flight, tmp_path):
    out = tmp_path / "report.html"
    done = mirrortwin("report", str(flight), "--format", "html", "--out", str(out))
    assert done.stdout.strip() == str(out)
    assert "Plotly.newPlot" in out.read_text(encoding="utf-8")


def test_json_for_programs(mirrortwin, flight):
    done = mirrortwin("report", str(flight), "--format", "json")
    values = json.loads(done.stdout)
    assert values["report"]["writer"] == "template"
    assert values["report"]["final"]["hr"] == 0.0
    assert values["about"]["Run"] == "flight"
    assert values["outcome"]["right"] is True
    assert values["outcome"]["injected"][0]["mode"] == "oil_cooler_maintenance"


def test_a_folder_that_does_not_say_what_was_injected(mirrortwin, flight, tmp_path):
    folder = tmp_path / "flight"
    folder.mkdir()
    for name in ("faulted.parquet", "mirror.parquet"):
        (folder / name).symlink_to(flight / name)
    done = mirrortwin("report", str(folder))
    assert done.returncode == 0
    assert "Injected" not in done.stdout


def test_a_question(mirrortwin, flight):
    done = mirrortwin("report", str(flight), "--ask", "why not the baffle seal?")
    assert done.returncode == 0
    assert "Baffle seal" in done.stdout


def test_a_run_of_the_app_by_its_id(mirrortwin, tmp_path):
    from core.fmea.fault import Fault
    from core.jobs.worker import fly_run
    from core.store.store import RunStore
    from core.twin.plan import Plan

    store = RunStore(tmp_path / "store")
    plan, fault = Plan.sampled(22), Fault("baffle_crack", 0.8, 60.0)
    record = store.create(plan, fault)
    result = fly_run(record.id, plan, fault, lambda event: None)
    store.save_pair(record.id, result.pair)
    store.save_result(record.id, result.diagnosis, result.report)
    store.close()
    done = mirrortwin("report", record.id, "--store", str(tmp_path / "store"))
    assert done.returncode == 0
    assert record.id in done.stdout
    assert "Injected: Baffle crack. Diagnosed: Baffle crack. ✓ right" in done.stdout


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["nonsense", "--store", "/nowhere"], "there is no folder nonsense"),
        (["FLIGHT", "--writer", "model"], "MIRRORTWIN_LLM_URL: is not set"),
        (["FLIGHT", "--ask", " "], "question: is empty"),
        (["FLIGHT", "--out", "/nowhere/at/all"], "--out: cannot write"),
    ],
)
def test_bad_requests_are_one_line(mirrortwin, flight, arguments, message):
    given = [str(flight) if word == "FLIGHT" else word for word in arguments]
    done = mirrortwin("report", *given)
    assert done.returncode == 2
    assert message in done.stderr
    assert "Traceback" not in done.stderr
