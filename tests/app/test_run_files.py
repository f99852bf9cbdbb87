"""Runs over HTTP: taken along, brought back, and nothing else let in."""

import zipfile
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

from app.pages.runs import files as run_files
from app.scenes import recordings
from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.predict import load_diagnoser
from core.exchange.log_files import read_log
from core.fmea.fault import Fault
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.store.labels import discard
from core.store.store import RunStore
from core.twin.actions import SetFault
from core.twin.flight import fly_pair
from core.twin.plan import Plan
from core.twin.trajectory import Pair

ZIP = {"Content-Type": run_files.ZIP}


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> RunStore:
    return RunStore(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def run_id(store: RunStore) -> str:
    """A finished run without a recording, as the command line leaves one."""
    plan, fault = Plan(duration_s=60.0, seed=5), Fault("engine_failure", 0.8, 20.0)
    pair = fly_pair(plan, fault)
    name = store.create(plan, fault).id
    diagnosis = load_diagnoser().diagnose(pair)
    store.save_pair(name, pair)
    store.save_result(name, diagnosis, grounded_template(open_case(diagnosis)))
    return name


@pytest.fixture(scope="module")
def client(store: RunStore, serve_app: Any) -> Iterator[httpx.Client]:
    """The routes alone, served by uvicorn: real sockets, since bodies are what this is about."""
    app = FastAPI()
    run_files.mount(app, store)
    with serve_app(lambda port: app) as url, httpx.Client(base_url=url) as client:
        yield client


def test_a_live_flight_is_recorded_with_what_was_injected(
    store: RunStore, run_id: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    live = store.create(Plan(duration_s=60.0, seed=5), Fault(), [SetFault(20.0, "baffle_crack")])
    store.save_pair(live.id, store.load_pair(run_id))
    store.save_result(live.id, *store.load_result(run_id))
    faults: list[Fault] = []

    def write(path: Path, pair: Pair, plan: Plan, fault: Fault, diagnosis: Diagnosis) -> None:
        faults.append(fault)
        path.write_bytes(b"RRF2")

    monkeypatch.setattr(recordings, "write_recording", write)
    recordings.with_recording(store, live.id)
    assert [(fault.mode, fault.onset_s) for fault in faults] == [("baffle_crack", 20.0)]
    discard(store, [live.id])


def test_a_run_is_taken_along_and_brought_back(
    client: httpx.Client, store: RunStore, run_id: str
) -> None:
    answer = client.get(f"{run_files.EXPORT_PATH}?id={run_id}")
    assert answer.status_code == 200
    assert f"mirrortwin-{run_id}.zip" in answer.headers["content-disposition"]
    names = zipfile.ZipFile(BytesIO(answer.content)).namelist()
    assert f"{run_id}/run.rrd" in names and f"{run_id}/report.html" in names
    record = store.get(run_id)
    again = client.post(run_files.IMPORT_PATH, content=answer.content, headers=ZIP)
    assert again.status_code == 422
    assert again.json()["problem"].endswith("which is in this store already.")
    discard(store, [run_id])
    assert client.get(f"{run_files.EXPORT_PATH}?id={run_id}").status_code == 404
    back = client.post(run_files.IMPORT_PATH, content=answer.content, headers=ZIP)
    assert back.json()["imported"][0]["id"] == run_id
    assert store.get(run_id) == record


def test_both_flights_come_as_logs(
    client: httpx.Client, run_id: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    logs = {}
    for side in run_files.SIDES:
        answer = client.get(f"/runs/{run_id}/{side}.csv")
        assert answer.headers["content-type"].startswith("text/csv")
        assert answer.headers["content-disposition"].startswith("attachment")
        path = tmp_path_factory.mktemp("log") / f"{side}.csv"
        path.write_bytes(answer.content)
        logs[side] = read_log(path)
        assert f'system_id="{run_id}-{side}"' in answer.text
    assert len(logs["faulted"]) == 60
    assert logs["faulted"].channel("E1 RPM")[-1] < logs["mirror"].channel("E1 RPM")[-1] - 100.0
    fast = client.get(f"/runs/{run_id}/mirror.csv", params={"rate": 10})
    assert len(fast.text.splitlines()) == 3 + 600


@pytest.mark.parametrize(
    ("path", "status", "said"),
    [
        ("/runs/files?id=nonsense", 404, "No run 'nonsense'"),
        ("/runs/nonsense/faulted.csv", 404, "No run 'nonsense'"),
        ("/runs/{run}/other.csv", 404, "faulted or mirror"),
        ("/runs/{run}/faulted.csv?rate=3", 422, "Rate: must be one of 1, 2, 5"),
        ("/runs/files", 422, ""),
        ("/runs/files?" + "&id=x" * 60, 422, ""),
    ],
)
def test_what_cannot_be_had_is_told(
    client: httpx.Client, run_id: str, path: str, status: int, said: str
) -> None:
    answer = client.get(path.format(run=run_id))
    assert answer.status_code == status
    assert said in answer.text and "Traceback" not in answer.text


def test_only_a_zip_is_taken(client: httpx.Client) -> None:
    path = run_files.IMPORT_PATH
    for headers in ({}, {"Content-Type": "text/plain"}):
        assert client.post(path, content=b"PK", headers=headers).status_code == 415
    answer = client.post(path, content=b"#airframe_info", headers=ZIP)
    assert answer.status_code == 422
    assert answer.json()["problem"].startswith("The file is not a zip file")
    assert client.get(path).status_code == 405


def test_uploads_are_bounded_announced_or_not(
    client: httpx.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(run_files, "MAX_PACKED", 3 << 20)

    def drip() -> Iterator[bytes]:
        for _ in range(64):
            yield bytes(65_536)

    big = client.post(run_files.IMPORT_PATH, content=bytes((3 << 20) + 1), headers=ZIP)
    dripped = client.post(run_files.IMPORT_PATH, content=drip(), headers=ZIP)
    for answer in (big, dripped):
        assert answer.status_code == 413
        assert answer.json()["problem"] == "The file is larger than 3 MB."
