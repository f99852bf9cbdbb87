"""The run store: what it keeps, and that nothing makes it lose any."""

import re
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from jobs_support import CRACK, SHORT_PLAN, a_diagnosis, a_report

from core.errors import StoreError
from core.fmea.fault import Fault
from core.store.store import SERVER_STOPPED, RunStore, default_root
from core.twin.plan import Plan
from core.twin.trajectory import Pair

REPORT = a_report()


def test_a_run_from_entry_to_result(store: RunStore, short_pair: Pair) -> None:
    record = store.create(SHORT_PLAN, CRACK)
    assert (record.status, record.attempts, record.finished) == ("queued", 0, False)
    assert store.update(record.id, status="running", attempts=1).status == "running"
    store.save_pair(record.id, short_pair)
    store.save_result(record.id, a_diagnosis(), REPORT)
    done = RunStore(store.root).get(record.id)  # as another process sees it
    assert (done.status, done.plan, done.fault) == ("done", SHORT_PLAN, CRACK)
    assert done.top == a_diagnosis().top
    assert done.top_probability == pytest.approx(0.81)
    diagnosis, report = store.load_result(record.id)
    assert report == REPORT
    assert diagnosis.to_dict() == a_diagnosis().to_dict()
    pair = store.load_pair(record.id)
    assert pair.residual.tobytes() == short_pair.residual.tobytes()


def test_records_come_newest_first(store: RunStore) -> None:
    made = [store.create(SHORT_PLAN, CRACK).id for _ in range(20)]
    assert [record.id for record in store.records()] == made[::-1]


@pytest.mark.parametrize("name", ["nonsense", "../../etc/passwd", "", "' OR 1=1 --"])
def test_an_unknown_run_is_named(store: RunStore, name: str) -> None:
    store.create(SHORT_PLAN, CRACK)
    for ask in (store.get, store.load_pair, store.load_result, store.recording_path):
        with pytest.raises(StoreError, match="no run"):
            ask(name)
    assert [path.name for path in (store.root / "runs").iterdir()] == []


def test_an_unfinished_run_has_no_flight_yet(store: RunStore) -> None:
    record = store.create(SHORT_PLAN, CRACK)
    with pytest.raises(StoreError, match=r"is queued: it has no run\.parquet"):
        store.load_pair(record.id)
    with pytest.raises(StoreError, match=r"is queued: it has no run\.json"):
        store.load_result(record.id)


def test_only_what_may_change_changes(store: RunStore) -> None:
    record = store.create(SHORT_PLAN, CRACK)
    for changes in ({}, {"id": "x"}, {"plan": SHORT_PLAN}, {"status": "lost"}, {"nonsense": 1}):
        with pytest.raises(ValueError):
            store.update(record.id, **changes)
    assert store.get(record.id) == record


def test_what_a_stopped_server_left_is_marked(store: RunStore) -> None:
    queued, running, done = (store.create(SHORT_PLAN, CRACK).id for _ in range(3))
    store.update(running, status="running")
    store.update(done, status="done")
    assert set(store.fail_unfinished()) == {queued, running}
    assert {(store.get(name).status, store.get(name).error) for name in (queued, running)} == {
        ("failed", SERVER_STOPPED)
    }
    assert store.get(done).status == "done"


def test_two_processes_share_a_store(store: RunStore) -> None:
    other = RunStore(store.root)
    names = {maker.create(SHORT_PLAN, CRACK).id for maker in (store, other) for _ in range(10)}
    assert {record.id for record in store.records()} == names
    assert {record.id for record in other.records()} == names


def test_a_kill_loses_nothing_that_was_acknowledged(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from core.store.store import RunStore;"
        "from core.fmea.fault import Fault; from core.twin.plan import Plan;"
        "store = RunStore(Path(sys.argv[1]))\n"
        "while True: print(store.create(Plan(), Fault()).id, flush=True)"
    )
    command = [sys.executable, "-c", program, str(tmp_path / "store")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as writer:
        assert writer.stdout is not None
        names = [writer.stdout.readline().strip() for _ in range(200)]
        writer.send_signal(signal.SIGKILL)
        rest = writer.stdout.read().splitlines(keepends=True)
        names += [line.strip() for line in rest if line.endswith("\n")]
    stored = {record.id for record in RunStore(tmp_path / "store").records()}
    assert set(names) <= stored
    assert len(stored) <= len(names) + 1


def test_the_default_folder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("MIRRORTWIN_HOME", raising=False)
    assert default_root() == tmp_path / ".mirrortwin"
    monkeypatch.setenv("MIRRORTWIN_HOME", str(tmp_path / "elsewhere"))
    assert default_root() == tmp_path / "elsewhere"


# -- folders that cannot be used -----------------------------------------------------------------


def test_a_file_where_the_folder_should_be(tmp_path: Path) -> None:
    (tmp_path / "store").write_text("not a folder")
    with pytest.raises(StoreError, match=r"store is a file, not a folder"):
        RunStore(tmp_path / "store")


def test_an_index_of_a_newer_version_is_left_alone(store: RunStore) -> None:
    store.close()
    with sqlite3.connect(store.root / "index.sqlite") as index:
        index.execute("PRAGMA user_version = 99")
    with pytest.raises(StoreError, match="newer MirrorTwin"):
        RunStore(store.root)


def test_a_record_of_another_version_hides_no_other(store: RunStore) -> None:
    good, strange = store.create(SHORT_PLAN, CRACK), store.create(SHORT_PLAN, CRACK)
    with sqlite3.connect(store.root / "index.sqlite") as index:
        index.execute('UPDATE runs SET fault = \'{"mode": "rust"}\' WHERE id = ?', [strange.id])
    assert store.records() == [good]
    with pytest.raises(StoreError, match=f"{strange.id} cannot be read by this version"):
        store.get(strange.id)


def test_a_read_only_folder_can_be_read(disk: Callable[[str], Path], short_pair: Pair) -> None:
    root = disk("size=16m") / "store"
    store = RunStore(root)
    record = store.create(SHORT_PLAN, CRACK)
    store.save_pair(record.id, short_pair)
    store.save_result(record.id, a_diagnosis(), REPORT)
    store.close()
    disk("ro")
    store = RunStore(root)
    assert store.read_only_reason is not None
    assert [known.id for known in store.records()] == [record.id]
    assert len(store.load_pair(record.id).faulted) == len(short_pair.faulted)
    assert store.load_result(record.id)[1] == REPORT
    assert store.recording_path(record.id).parent.is_dir()
    for refused in (
        lambda: store.create(SHORT_PLAN, CRACK),
        lambda: store.update(record.id, status="failed"),
        lambda: store.save_pair(record.id, short_pair),
        lambda: store.save_result(record.id, a_diagnosis(), REPORT),
    ):
        with pytest.raises(StoreError, match=re.escape(str(root))):
            refused()
    assert store.get(record.id).status == "done"
    disk("rw")
    store.create(SHORT_PLAN, CRACK)  # no restart needed
    assert len(store.records()) == 2
    store.close()


def test_a_read_only_folder_without_a_store_is_empty(disk: Callable[[str], Path]) -> None:
    disk("size=1m")
    store = RunStore(disk("ro") / "store")
    assert store.records() == []
    with pytest.raises(StoreError, match="MIRRORTWIN_HOME"):
        store.create(SHORT_PLAN, CRACK)


def test_a_full_disk_keeps_what_it_has(disk: Callable[[str], Path], short_pair: Pair) -> None:
    where = disk("size=3m")
    store = RunStore(where / "store")
    first = store.create(SHORT_PLAN, CRACK)
    store.save_pair(first.id, short_pair)
    store.save_result(first.id, a_diagnosis(), REPORT)
    second = store.create(Plan(duration_s=40.0, seed=6), Fault())
    _fill(where)
    with pytest.raises(StoreError, match="No space left") as caught:
        store.save_pair(second.id, short_pair)
    assert str(store.root) in str(caught.value)
    with pytest.raises(StoreError, match="full"):
        for _ in range(1000):
            store.create(SHORT_PLAN, CRACK)
    known = [record.id for record in store.records()]
    store.close()
    store = RunStore(where / "store")
    assert [record.id for record in store.records()] == known
    assert store.load_pair(first.id).residual.tobytes() == short_pair.residual.tobytes()
    assert store.get(second.id).status == "queued"
    (where / "filler").unlink()
    store.save_pair(second.id, short_pair)
    store.create(SHORT_PLAN, CRACK)
    store.close()


def _fill(where: Path) -> None:
    with (where / "filler").open("wb", buffering=0) as filler:
        try:
            while filler.write(b"\0" * 4096):
                pass
        except OSError:
            return


def test_a_report_can_be_written_anew(store: RunStore) -> None:
    record = store.create(SHORT_PLAN, CRACK)
    store.save_result(record.id, a_diagnosis(), REPORT)
    other = replace(REPORT, writer="a model", notes=("It took long.",))
    store.save_report(record.id, other)
    diagnosis, report = RunStore(store.root).load_result(record.id)
    assert report == other
    assert diagnosis.to_dict() == a_diagnosis().to_dict()
    with pytest.raises(StoreError, match="queued"):
        store.save_report(store.create(SHORT_PLAN, CRACK).id, other)


def test_a_changed_digit_in_run_json_is_found(store: RunStore) -> None:
    record = store.create(SHORT_PLAN, CRACK)
    store.save_result(record.id, a_diagnosis(), REPORT)
    path = store.root / "runs" / record.id / "run.json"
    path.write_text(path.read_text().replace("12.5", "13.5"))
    with pytest.raises(StoreError, match=r"run\.json is damaged \(checksum\)"):
        store.load_result(record.id)
    with pytest.raises(StoreError, match=r"run\.json is damaged \(checksum\)"):
        store.save_report(record.id, REPORT)  # would make it look whole


def test_a_recording_has_a_checksum_and_no_folder_is_made_by_asking(store: RunStore) -> None:
    record = store.create(SHORT_PLAN, CRACK)
    assert not store.has_recording(record.id)
    assert list((store.root / "runs").iterdir()) == []
    store.save_recording(record.id, lambda path: path.write_bytes(b"RRF2 and so on") and None)
    assert store.has_recording(record.id)
    store.recording_path(record.id).write_bytes(b"RRF2 and so oN")
    assert not store.has_recording(record.id)


@pytest.mark.parametrize(
    ("column", "value"),
    [("created", "yesterday"), ("created", "9999-12-31T00:00:00+00:00"), ("status", "lost"),
     ("attempts", "many"), ("plan", "[" * 100_000), ("fault", "[]"), ("top_probability", "x")],
)  # fmt: skip
def test_a_bad_row_hides_no_other(store: RunStore, column: str, value: str) -> None:
    good, bad = store.create(SHORT_PLAN, CRACK), store.create(SHORT_PLAN, CRACK)
    with store.writing() as index:
        index.execute(f"UPDATE runs SET {column} = ? WHERE id = ?", [value, bad.id])
    assert store.records() == [good]
    with pytest.raises(StoreError, match=f"{bad.id} cannot be read by this version"):
        store.get(bad.id)
