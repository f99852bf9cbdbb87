"""A store whose index or folder was lost, damaged or replaced, and what killed writers left."""

import fcntl
import logging
import os
import shutil
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from jobs_support import CRACK, SHORT_PLAN, a_diagnosis, a_report

from core.errors import StoreError
from core.files import read_json, write_json
from core.store.labels import (
    Label,
    delete,
    discard,
    discarded,
    empty,
    label_of,
    labels,
    restore,
    write_label,
)
from core.store.records import RunRecord
from core.store.store import RunStore
from core.twin.trajectory import Pair

LABEL = Label(("shop floor",), "a note")


def finished(store: RunStore, pair: Pair) -> RunRecord:
    """A run with all that is kept of one."""
    record = store.create(SHORT_PLAN, CRACK)
    store.save_pair(record.id, pair)
    return store.save_result(record.id, a_diagnosis(), a_report())


@pytest.fixture(autouse=True)
def warnings_are_logged(caplog: pytest.LogCaptureFixture) -> None:
    """Whatever an earlier test has set the level to."""
    caplog.set_level(logging.WARNING)


@pytest.fixture
def closed(tmp_path: Path, short_pair: Pair) -> Iterator[tuple[Path, list[RunRecord]]]:
    """A closed store: a run with a label, one without, one thrown away, and one that failed."""
    store = RunStore(tmp_path / "store")
    done = [finished(store, short_pair) for _ in range(3)]
    write_label(store, done[0].id, LABEL)
    write_label(store, done[2].id, Label((), "thrown away"))
    discard(store, [done[2].id])
    failed = store.create(SHORT_PLAN, CRACK)
    failed = store.update(failed.id, status="failed", error="it fell")
    store.close()
    yield store.root, [*done, failed]


def remove(root: Path) -> None:
    for path in root.glob("index.sqlite*"):
        path.unlink()


def blank(root: Path) -> None:
    remove(root)
    (root / "index.sqlite").touch()


def truncate(root: Path) -> None:
    path = root / "index.sqlite"
    os.truncate(path, path.stat().st_size // 2 - 100)


def garble(root: Path) -> None:
    (root / "index.sqlite").write_bytes(b"no database at all" * 100)


def flip(root: Path) -> None:
    """All pages but the first."""
    path = root / "index.sqlite"
    content = bytearray(path.read_bytes())
    for place in range(4096, len(content), 7):
        content[place] ^= 0xFF
    path.write_bytes(content)


@pytest.mark.parametrize("harm", [remove, blank, truncate, garble, flip])
def test_a_lost_index_is_made_again_from_the_run_folders(
    closed: tuple[Path, list[RunRecord]],
    short_pair: Pair,
    caplog: pytest.LogCaptureFixture,
    harm: Callable[[Path], None],
) -> None:
    root, (first, second, thrown, _) = closed
    harm(root)
    harmed = (root / "index.sqlite").read_bytes() if harm not in (remove, blank) else None
    with caplog.at_level(logging.WARNING):
        store = RunStore(root)
    assert "rebuilt from the run folders: 3 runs found" in caplog.text
    found = [record for record in store.records() if record.status == "done"]
    assert found == [second, first]
    assert label_of(store, first.id) == LABEL
    assert store.load_pair(first.id).residual.tobytes() == short_pair.residual.tobytes()
    assert discarded(store) == [thrown.id]
    assert restore(store, [thrown.id]) == [thrown.id]
    assert (store.get(thrown.id), label_of(store, thrown.id).note) == (thrown, "thrown away")
    asides = [path for path in root.glob("index.sqlite.damaged-*") if path.suffix[-1].isdigit()]
    assert [path.read_bytes() for path in asides] == ([harmed] if harmed else [])
    store.create(SHORT_PLAN, CRACK)
    store.close()
    caplog.clear()
    RunStore(root).close()
    assert caplog.text == ""


def test_what_a_damaged_index_still_says_of_runs_without_files_is_kept(
    closed: tuple[Path, list[RunRecord]],
) -> None:
    """Runs that failed have no files; and what was written on runs was once in the index alone."""
    root, (first, *_, failed) = closed
    (root / "runs" / first.id / "label.json").unlink()
    with sqlite3.connect(root / "index.sqlite") as index:
        pages = {
            row[0]: row[1] for row in index.execute("SELECT name, rootpage FROM sqlite_master")
        }
        size = index.execute("PRAGMA page_size").fetchone()[0]
        index.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    index.close()
    content = bytearray((root / "index.sqlite").read_bytes())
    page = (pages["runs_created"] - 1) * size
    content[page : page + size] = bytes(size)
    (root / "index.sqlite").write_bytes(content)
    store = RunStore(root)
    assert store.get(failed.id) == failed
    assert label_of(store, first.id) == LABEL


def test_an_index_that_misses_what_it_lists_is_damaged(
    closed: tuple[Path, list[RunRecord]],
) -> None:
    """A flipped page: the list shows a run that its address does not find."""
    root, (first, *_) = closed
    path = root / "index.sqlite"
    content = path.read_bytes()
    name = first.id.encode()
    places = [place for place in range(len(content)) if content.startswith(name, place)]
    for place in places:
        if content[place + len(name) : place + len(name) + 4] == b"2026":
            continue  # the row itself
        path.write_bytes(content[:place] + b"3" + content[place + 1 :])
        store = RunStore(root)
        assert store.get(first.id) == first
        store.close()
        assert list(root.glob("index.sqlite.damaged-*"))
        return
    pytest.fail("no lookup by name in the index")


def test_a_folder_that_lost_its_row_is_entered_and_a_deleted_one_is_not(
    closed: tuple[Path, list[RunRecord]], caplog: pytest.LogCaptureFixture
) -> None:
    root, (first, second, *_) = closed
    store = RunStore(root)
    with store.index.writing() as index:
        index.execute("DELETE FROM runs WHERE id = ?", (first.id,))
    delete(store, [second.id])
    store.close()
    store = RunStore(root)
    assert [record.id for record in store.records() if record.status == "done"] == [first.id]
    assert "not in its index were entered: 1 run found" in caplog.text


def test_a_folder_without_a_whole_record_is_left_alone(
    closed: tuple[Path, list[RunRecord]], caplog: pytest.LogCaptureFixture
) -> None:
    root, (first, second, *_) = closed
    path = root / "runs" / first.id / "run.json"
    path.write_text(path.read_text().replace("0.81", "0.18"))
    other = root / "runs" / second.id / "run.json"
    other.write_text("[" * 100_000)
    remove(root)
    store = RunStore(root)
    assert store.records() == []
    assert "1 run found; 2 run folders without a whole run.json were left" in caplog.text
    assert path.exists() and other.exists()
    assert (path.parent / "run.parquet").exists()


def test_what_was_written_on_runs_of_an_earlier_version_is_kept_beside_them(
    closed: tuple[Path, list[RunRecord]],
) -> None:
    root, (first, *_) = closed
    path = root / "runs" / first.id / "label.json"
    path.unlink()
    RunStore(root).close()
    assert read_json(path)["tags"] == ["shop floor"]
    path.write_text('{"tags": [5], "note": "x", "discarded": null}')
    remove(root)
    store = RunStore(root)
    assert label_of(store, first.id) == Label()


def test_a_run_that_was_stored_whole_before_its_row_could_say_so_is_done(
    store: RunStore, short_pair: Pair
) -> None:
    record = finished(store, short_pair)
    store.update(record.id, status="running", top=None, top_probability=None)
    store.close()
    assert RunStore(store.root).get(record.id) == record


def test_a_damaged_index_in_a_read_only_folder_is_read_from_the_run_folders(
    disk: Callable[[str], Path], short_pair: Pair
) -> None:
    root = disk("size=16m") / "store"
    store = RunStore(root)
    record = finished(store, short_pair)
    store.close()
    garble(root)
    disk("ro")
    store = RunStore(root)
    assert store.records() == [record]
    with pytest.raises(StoreError, match=r"(?i)read-only"):
        store.create(SHORT_PLAN, CRACK)
    store.close()
    disk("rw")


# -- under a running server ----------------------------------------------------------------------


def test_a_store_that_was_removed_or_replaced_is_noticed(
    store: RunStore, short_pair: Pair, tmp_path: Path
) -> None:
    record = finished(store, short_pair)
    elsewhere = tmp_path / "elsewhere"
    asks: tuple[Callable[[], object], ...] = (
        lambda: store.create(SHORT_PLAN, CRACK),
        lambda: store.save_pair(record.id, short_pair),
        lambda: store.save_result(record.id, a_diagnosis(), a_report()),
        lambda: store.get(record.id),
        store.records,
        lambda: labels(store),
        lambda: delete(store, [record.id]),
    )

    def replaced() -> None:
        other = RunStore(store.root)
        other.create(SHORT_PLAN, CRACK)
        other.close()

    store.root.rename(elsewhere)
    for happens in (lambda: None, replaced):
        happens()
        for ask in asks:
            with pytest.raises(StoreError, match="was removed or replaced while it was open"):
                ask()
    assert len(list((store.root / "runs").iterdir())) == 0
    shutil.rmtree(store.root)
    elsewhere.rename(store.root)
    assert store.get(record.id) == record  # put back
    remove(store.root)
    with pytest.raises(StoreError, match="restart MirrorTwin"):
        store.create(SHORT_PLAN, CRACK)
    assert RunStore(store.root).records() == [record]


# -- what killed writers leave -------------------------------------------------------------------


def left_over(root: Path, run_id: str) -> list[Path]:
    """What a kill leaves here and there."""
    runs, teach = root / "runs", root / "teach" / "20261123T061500-aaaaaaaa"
    empty_run = runs / "20261123T061500-bbbbbbbb"
    unpacked = runs / ".import-x1y2" / run_id
    for folder in (teach, empty_run, unpacked):
        folder.mkdir(parents=True)
    files = [
        runs / run_id / ".run.parquet.0f3a77b2.tmp",
        root / ".secret.0f3a77b2.tmp",
        teach / "flight.parquet",
        unpacked / "run.json",
    ]
    for path in files:
        path.write_bytes(b"half")
    return [*files, empty_run, teach, unpacked.parent]


def test_what_killed_writers_left_is_swept_at_the_start_and_nothing_else(
    store: RunStore, short_pair: Pair
) -> None:
    record = finished(store, short_pair)
    left = left_over(store.root, record.id)
    kept = [
        store.root / "runs" / "notes.txt",
        store.root / "runs" / record.id / ".mine.tmp",
        store.root / "runs" / "my-folder" / ".run.parquet.0f3a77b2.tmp",
        store.root / "teach" / "20261123T061500-cccccccc" / "attempt.json",
    ]
    for path in kept:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(b"mine")
    other = RunStore(store.root)  # beside one that is open
    other.close()
    assert all(path.exists() for path in left)
    store.close()
    RunStore(store.root).close()
    assert [path for path in left if path.exists()] == []
    assert all(path.exists() for path in kept)
    assert (store.root / "runs" / record.id / "run.parquet").exists()


def test_nothing_of_another_process_is_swept(store: RunStore, short_pair: Pair) -> None:
    record = finished(store, short_pair)
    store.close()
    program = (
        "import sys; from pathlib import Path; from core.store.store import RunStore;"
        "store = RunStore(Path(sys.argv[1])); print('open', flush=True); sys.stdin.read()"
    )
    command = [sys.executable, "-c", program, str(store.root)]
    with subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as other:
        assert other.stdin is not None and other.stdout is not None
        assert other.stdout.readline() == "open\n"
        left = left_over(store.root, record.id)
        RunStore(store.root).close()
        assert all(path.exists() for path in left)
        other.stdin.close()
    RunStore(store.root).close()
    assert [path for path in left if path.exists()] == []


def test_a_file_system_without_locks_is_no_obstacle(
    store: RunStore, short_pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    record = finished(store, short_pair)
    store.close()
    left = left_over(store.root, record.id)

    def refuse(*_: object) -> None:
        raise OSError("no locks")

    monkeypatch.setattr(fcntl, "flock", refuse)
    again = RunStore(store.root)
    assert again.records() == [record]
    assert all(path.exists() for path in left)
    again.close()


# -- a full disk ---------------------------------------------------------------------------------


def fill(where: Path) -> None:
    """Take all the room that is left, to the last byte."""
    number = len(list(where.glob("filler*")))
    with (where / f"filler{number}").open("wb", buffering=0) as filler:
        for size in (4096, 1):
            try:
                while filler.write(b"\0" * size):
                    pass
            except OSError:
                continue


def test_a_full_disk_is_freed_by_deleting(disk: Callable[[str], Path], short_pair: Pair) -> None:
    where = disk("size=8m")
    store = RunStore(where / "store")
    first, second, third = (finished(store, short_pair).id for _ in range(3))
    fill(where)
    with pytest.raises(StoreError, match=r"(?i)full|no space"):
        for _ in range(1000):
            store.create(SHORT_PLAN, CRACK)
    free = shutil.disk_usage(where).free
    assert discard(store, [first]) == []  # there is nothing to have back: it made the room
    assert shutil.disk_usage(where).free > free
    assert first not in [record.id for record in store.records()]
    assert discard(store, [second]) == [second]
    assert restore(store, [second]) == [second]
    assert discard(store, [second]) == [second]
    fill(where)
    for _ in range(500):  # what was thrown away makes room when room is needed
        store.create(SHORT_PLAN, CRACK)
        if not discarded(store):
            break
    assert discarded(store) == []
    assert store.load_pair(third).residual.tobytes() == short_pair.residual.tobytes()
    store.close()


def test_a_flight_takes_the_room_of_what_was_thrown_away(
    disk: Callable[[str], Path], short_pair: Pair
) -> None:
    where = disk("size=8m")
    store = RunStore(where / "store")
    thrown, kept = finished(store, short_pair).id, finished(store, short_pair).id
    new = store.create(SHORT_PLAN, CRACK).id
    assert discard(store, [thrown]) == [thrown]
    fill(where)
    store.save_pair(new, short_pair)
    assert store.load_pair(new).residual.tobytes() == short_pair.residual.tobytes()
    assert discarded(store) == []
    assert store.get(kept).status == "done"
    store.close()


def test_a_server_that_starts_on_a_full_disk_can_free_it(
    disk: Callable[[str], Path], short_pair: Pair
) -> None:
    where = disk("size=8m")
    store = RunStore(where / "store")
    first, second, old = (finished(store, short_pair).id for _ in range(3))
    discard(store, [old])
    store.close()
    fill(where)
    store = RunStore(where / "store")
    assert {record.id for record in store.records()} == {first, second}
    discard(store, [first])
    assert [record.id for record in store.records()] == [second]
    store.create(SHORT_PLAN, CRACK)
    store.close()


def test_deleting_files_first_never_brings_a_deleted_run_back(
    store: RunStore, short_pair: Pair, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Broken off between the files and the row: it is still thrown away, and goes next time."""
    record = finished(store, short_pair)
    discard(store, [record.id])
    with monkeypatch.context() as broken:
        broken.setattr(
            "core.store.rows.forget", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt)
        )
        with pytest.raises(KeyboardInterrupt):
            store.purge()
    store.close()
    again = RunStore(store.root)
    assert again.records() == []
    assert discarded(again) == [record.id]
    again.purge()
    assert discarded(again) == []
    again.close()


def test_an_old_label_file_never_purges_a_run_that_was_had_back(
    store: RunStore, short_pair: Pair
) -> None:
    record = finished(store, short_pair)
    discard(store, [record.id])
    assert read_json(store.root / "runs" / record.id / "label.json")["discarded"]
    restore(store, [record.id])
    assert not (store.root / "runs" / record.id / "label.json").exists()
    store.close()
    remove(store.root)
    again = RunStore(store.root)
    assert empty(again) == []
    assert again.records() == [record]
    write_json(again.root / "runs" / record.id / "label.json", {"tags": []})  # no label of ours
    again.close()
    remove(store.root)
    assert RunStore(store.root).records() == [record]
