"""Runs packed and unpacked: the same runs again, and nothing else gets in."""

import hashlib
import io
import json
import sqlite3
import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jobs_support import CRACK, SHORT_PLAN

from core.diagnosis.predict import load_diagnoser
from core.errors import InputError, StoreError
from core.exchange import run_archive as parcel
from core.exchange.run_archive import MANIFEST, pack, unpack
from core.files import read_json
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.store.labels import (
    Label,
    delete,
    discard,
    discarded,
    label_of,
    restore,
    write_label,
)
from core.store.records import RunRecord
from core.store.store import RunStore
from core.twin.flight_file import write_pair
from core.twin.trajectory import Pair

Files = dict[str, bytes]


@dataclass(repr=False)
class Packed:
    """A store with a finished run, the run's name, and the bytes of its parcel."""

    store: RunStore
    run_id: str
    content: bytes


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory, short_pair: Pair) -> Iterator[Packed]:
    """A store with a finished run, the run's name, and the bytes of its parcel."""
    folder = tmp_path_factory.mktemp("parcel")
    store = RunStore(folder / "store")
    run_id = store.create(SHORT_PLAN, CRACK).id
    store.save_pair(run_id, short_pair)
    diagnosis = load_diagnoser().diagnose(short_pair)
    store.save_result(run_id, diagnosis, grounded_template(open_case(diagnosis)))
    store.recording_path(run_id).write_bytes(b"RRF2 and so on")
    write_label(store, run_id, Label(("tagged", "<b>bold</b>"), "a note\nof two lines"))
    pack(store, [run_id], folder / "run.zip")
    yield Packed(store, run_id, (folder / "run.zip").read_bytes())
    store.close()


def zipped(files: Files, **options: Any) -> bytes:
    """A zip file of these."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", **options) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def unzipped(content: bytes) -> Files:
    """What is in a zip file."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def signed(files: Files) -> Files:
    """The same with a manifest whose checksums are right."""
    manifest = json.loads(files[MANIFEST])
    for run_id, said in manifest["runs"].items():
        said["sha256"] = {
            name.removeprefix(f"{run_id}/"): hashlib.sha256(content).hexdigest()
            for name, content in files.items()
            if name.startswith(f"{run_id}/")
        }
    return files | {MANIFEST: json.dumps(manifest).encode()}


@pytest.fixture
def refused(store: RunStore, tmp_path: Path) -> Callable[[bytes], str]:
    """Why a file is refused; the store must be as empty as before."""

    def why(content: bytes) -> str:
        path = tmp_path / "import.zip"
        path.write_bytes(content)
        with pytest.raises(InputError) as caught:
            unpack(store, path)
        assert caught.value.field == "file"
        assert store.records() == []
        assert list((store.root / "runs").iterdir()) == []
        assert str(tmp_path) not in str(caught.value)
        return caught.value.problem

    return why


def test_export_delete_import_gives_the_same_run(packed: Packed, tmp_path: Path) -> None:
    store, run_id, content = packed.store, packed.run_id, packed.content
    path = tmp_path / "run.zip"
    path.write_bytes(content)
    record, label, pair = store.get(run_id), label_of(store, run_id), store.load_pair(run_id)
    files = {
        name: store.recording_path(run_id).with_name(name).read_bytes() for name in parcel.FILES
    }
    with pytest.raises(InputError, match=f"{run_id}, which is in this store already"):
        unpack(store, path)
    for throw_away in (lambda: discard(store, [run_id]), lambda: delete(store, [run_id])):
        throw_away()
        with pytest.raises(StoreError):
            store.get(run_id)
        assert unpack(store, path) == [record]
        assert store.get(run_id) == record
        assert label_of(store, run_id) == label
        assert store.load_pair(run_id).faulted.states.tobytes() == pair.faulted.states.tobytes()
        for name, was in files.items():
            assert store.recording_path(run_id).with_name(name).read_bytes() == was
    again = tmp_path / "again.zip"
    pack(store, [run_id], again)
    repacked = unzipped(again.read_bytes())
    assert {f"{run_id}/{name}": was for name, was in files.items()}.items() <= repacked.items()


def test_a_parcel_is_what_its_manifest_says(packed: Packed) -> None:
    run_id, content = packed.run_id, packed.content
    files = unzipped(content)
    assert set(files) == {MANIFEST, *(f"{run_id}/{n}" for n in (*parcel.FILES, *parcel.REPORTS))}
    sums = json.loads(files[MANIFEST])["runs"][run_id]["sha256"]
    for name, digest in sums.items():
        assert hashlib.sha256(files[f"{run_id}/{name}"]).hexdigest() == digest
    assert b"<b>bold" not in files[f"{run_id}/report.html"]


def test_only_finished_runs_are_packed(store: RunStore, tmp_path: Path) -> None:
    run_id = store.create(SHORT_PLAN, CRACK).id
    with pytest.raises(InputError, match=f"{run_id} is queued"):
        pack(store, [run_id], tmp_path / "x.zip")
    with pytest.raises(InputError, match="1 to 50"):
        pack(store, [], tmp_path / "x.zip")
    assert not (tmp_path / "x.zip").exists()


@pytest.mark.parametrize(
    "name",
    [
        "../../evil.json",
        "/etc/passwd",
        "..\\run.json",
        "20261123T061500-k3x9q2wz/../run.json",
        "20261123T061500-k3x9q2wz/run.sh",
        "run.json",
        "C:/run.json",
        "<img src=x onerror=alert(1)>",
    ],
)
def test_a_name_that_leads_elsewhere_is_refused(
    packed: Packed, refused: Callable[[bytes], str], name: str
) -> None:
    files = unzipped(packed.content) | {name: b"{}"}
    assert "which no export of MirrorTwin does" in refused(zipped(files))


def test_wrong_files_are_told_apart(packed: Packed, refused: Callable[[bytes], str]) -> None:
    run_id, content = packed.run_id, packed.content
    files = unzipped(content)
    assert "not a zip file" in refused(b"")
    assert "not a zip file" in refused(b"#airframe_info, log_version=1.00\n" * 9)
    assert "not a zip file" in refused(content[:-40])
    assert "no manifest.json" in refused(zipped({f"{run_id}/run.json": b"{}"}))
    assert "not an export" in refused(zipped({MANIFEST: b'{"format": "other"}'}))
    assert "cannot be read" in refused(zipped({MANIFEST: b"[" * 100_000}))
    assert "format 99" in refused(
        zipped({MANIFEST: json.dumps({"format": parcel.FORMAT, "version": 99}).encode()})
    )
    short = {name: data for name, data in files.items() if not name.endswith(".parquet")}
    assert "does not hold the files" in refused(zipped(short))
    assert "does not hold the files" in refused(zipped(signed(short)))
    assert "in a way" in refused(zipped(files, compression=zipfile.ZIP_LZMA))


def test_what_was_changed_on_the_way_is_refused(
    packed: Packed, refused: Callable[[bytes], str]
) -> None:
    run_id, content = packed.run_id, packed.content
    name = f"{run_id}/run.parquet"
    flipped = bytearray(content)
    place = content.index(b"PAR1") + 4000
    flipped[place] ^= 1
    assert "damaged" in refused(bytes(flipped))
    files = unzipped(content)
    assert "checksum" in refused(zipped(files | {name: files[name][:-1] + b"?"}))


def test_what_is_signed_but_no_run_is_refused(
    packed: Packed, refused: Callable[[bytes], str]
) -> None:
    run_id, content = packed.run_id, packed.content
    files = unzipped(content)

    def why(name: str, data: bytes) -> str:
        return refused(zipped(signed(files | {f"{run_id}/{name}": data})))

    def why_json(*path: str, value: Any) -> str:
        values = json.loads(files[f"{run_id}/run.json"])
        del values["sha256"]  # as of an earlier version
        inner = values
        for step in path[:-1]:
            inner = inner[step]
        inner[path[-1]] = value
        return why("run.json", json.dumps(values).encode())

    assert "not a flight" in why("run.parquet", b"PAR1 not at all PAR1")
    assert "not a recording" in why("run.rrd", b"MZ")
    assert "not the record" in why("run.json", b"{}")
    assert "damaged" in why("run.json", b"[" * 100_000)
    changed = files[f"{run_id}/run.json"].replace(b'"seed": 5', b'"seed": 6')
    assert "run.json is damaged (checksum)" in why("run.json", changed)
    assert "damaged" in why("run.json", b"{")
    assert "id" in why_json("record", "id", value="../../x")
    assert "tells of" in why_json("record", "id", value="20261123T061500-k3x9q2wz")
    assert "status" in why_json("record", "status", value="<script>")
    assert "severity" in why_json("record", "fault", "severity", value=7)
    assert "altitude_ft" in why_json("record", "plan", "altitude_ft", value=1e9)
    assert "verdict" in why_json("record", "top", value="<b>nominal</b>")
    assert "created" in why_json("record", "created", value="yesterday")
    assert "samples" in why_json("record", "plan", "duration_s", value=31.0)
    assert "run.json" in why_json("diagnosis", "evidence", value=[1])
    assert "run.json" in why_json("diagnosis", "probabilities", value=[])
    assert "run.json" in why_json("report", value={"sentences": [{}]})
    assert "attempts" in why_json("record", "attempts", value=2**70)
    assert "cannot be kept" in why_json("record", "code_version", value="\ud800")
    assert "cannot be kept" in why_json("record", "error", value="\udfff")
    assert "cannot be kept" in why_json("report", "writer", value="half \ud83d")
    assert "cannot be kept" in why_json("diagnosis", "energy", value=float("nan"))
    assert "years 2000 to 2199" in why_json("record", "created", value="9999-12-31T23:59:59+00:00")
    assert "record" in why_json("record", "plan", "speed_kt", value=10**400)


def test_what_is_no_flight_is_refused(
    packed: Packed, refused: Callable[[bytes], str], short_pair: Pair, tmp_path: Path
) -> None:
    """Columns that no flight has, values that no flight comes near."""
    files = unzipped(packed.content)

    def why(change: Callable[[pa.Table], pa.Table]) -> str:
        path = tmp_path / "changed.parquet"
        write_pair(path, short_pair)
        pq.write_table(change(pq.read_table(path)), path, compression="zstd")
        name = f"{packed.run_id}/run.parquet"
        return refused(zipped(signed(files | {name: path.read_bytes()})))

    def put(name: str, value: float) -> Callable[[pa.Table], pa.Table]:
        def change(table: pa.Table) -> pa.Table:
            place, column = table.column_names.index(name), table[name].to_numpy().copy()
            column[0] = value
            field = table.schema.field(name)
            return table.set_column(place, field, pa.array(column, field.type))

        return change

    zeros = pa.array(np.zeros(len(short_pair.faulted), np.int32))
    big = pa.DictionaryArray.from_arrays(zeros, pa.array(["x" * (1 << 20)]))
    assert "column 'big' that no flight has" in why(lambda table: table.append_column("big", big))
    many = {f"c{number}": zeros for number in range(4000)}
    assert "that no flight has (and 3999 more)" in why(
        lambda table: pa.table(
            {**dict(zip(table.column_names, table.columns, strict=True)), **many}
        )
    )
    whole = pa.float64()
    assert "must be float" in why(
        lambda table: table.set_column(
            table.column_names.index("mirror.OAT"), "mirror.OAT", table["mirror.OAT"].cast(whole)
        )
    )
    assert "3e+38 in E1 RPM, which no flight comes near" in why(put("faulted.E1 RPM", 3e38))
    assert "times outside 0 to 7200 s" in why(put("time_s", -1e308))
    assert "not finite" in why(put("mirror.air_fuel_ratio", float("inf")))
    assert "2001 samples" in why(lambda table: pa.concat_tables([table, table[-1:]]))


def test_a_flight_that_ended_before_its_plan_is_taken(
    packed: Packed, store: RunStore, short_pair: Pair, tmp_path: Path
) -> None:
    write_pair(tmp_path / "run.parquet", short_pair[:1])
    name = f"{packed.run_id}/run.parquet"
    files = unzipped(packed.content) | {name: (tmp_path / "run.parquet").read_bytes()}
    (tmp_path / "short.zip").write_bytes(zipped(signed(files)))
    (record,) = unpack(store, tmp_path / "short.zip")
    assert len(store.load_pair(record.id).faulted) == 1


@pytest.mark.parametrize("was_thrown_away", [True, False])
def test_an_import_that_the_index_refuses_leaves_all_as_it_was(
    packed: Packed,
    store: RunStore,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    was_thrown_away: bool,
) -> None:
    path, run_id = tmp_path / "run.zip", packed.run_id
    path.write_bytes(packed.content)
    if was_thrown_away:
        unpack(store, path)
        discard(store, [run_id])
    before = sorted(item for item in (store.root / "runs").rglob("*"))

    def refuse(index: sqlite3.Connection, record: RunRecord) -> None:
        index.execute("DELETE FROM runs")
        raise OverflowError("too large for SQLite")

    with monkeypatch.context() as refusing:
        refusing.setattr("core.store.rows.insert", refuse)
        with pytest.raises(OverflowError):
            unpack(store, path)
    assert sorted(item for item in (store.root / "runs").rglob("*")) == before
    assert discarded(store) == ([run_id] if was_thrown_away else [])
    assert store.records() == []
    if was_thrown_away:
        assert restore(store, [run_id]) == [run_id]
        assert store.load_result(run_id)
    else:
        assert unpack(store, path)


def test_an_import_on_a_full_disk_takes_the_room_of_what_was_thrown_away(
    packed: Packed, disk: Callable[[str], Path], tmp_path: Path
) -> None:
    path = tmp_path / "run.zip"
    path.write_bytes(packed.content)
    store = RunStore(disk("size=4m") / "store")
    pair = packed.store.load_pair(packed.run_id)
    thrown = [store.create(SHORT_PLAN, CRACK).id for _ in range(3)]
    for run_id in thrown:
        store.save_pair(run_id, pair)
        store.update(run_id, status="done")
    with pytest.raises(StoreError, match=r"(?i)no space"):
        _fill(store, path)
    assert not list((store.root / "runs").glob(".import-*"))
    assert [record.id for record in store.records()] == thrown[::-1]
    discard(store, thrown)
    (record,) = unpack(store, path)
    assert store.get(record.id) == record
    store.close()


def _fill(store: RunStore, path: Path) -> None:
    with (store.root / "filler").open("wb", buffering=0) as filler:
        with suppress(OSError):
            while filler.write(b"\0" * 4096):
                pass
        filler.truncate(filler.tell() - (200 << 10))
    unpack(store, path)


def test_an_imported_recording_has_a_checksum(
    packed: Packed, store: RunStore, tmp_path: Path
) -> None:
    (tmp_path / "run.zip").write_bytes(packed.content)
    (record,) = unpack(store, tmp_path / "run.zip")
    assert store.has_recording(record.id)
    store.recording_path(record.id).write_bytes(b"RRF2 and so oN")
    assert not store.has_recording(record.id)


def test_more_entries_than_an_export_has_are_refused_at_once(
    packed: Packed, refused: Callable[[bytes], str]
) -> None:
    files = unzipped(packed.content)
    names = [
        f"20261123T061500-{a}{b}aaaaaa/run.json"
        for a in "abcdefghjkmnp"
        for b in "23456789abcdefghjkmn"
    ]
    assert "lists more files than an export has" in refused(
        zipped(files | dict.fromkeys(names, b"{}"))
    )


@pytest.mark.parametrize(
    "label", [{"tags": [5], "note": ""}, {"tags": ["\ud800"], "note": ""}, {"tags": [], "note": 7}]
)
def test_a_bad_label_is_refused(
    packed: Packed, refused: Callable[[bytes], str], label: dict[str, Any]
) -> None:
    files = unzipped(packed.content)
    manifest = json.loads(files[MANIFEST])
    manifest["runs"][packed.run_id] |= label
    assert MANIFEST in refused(zipped(files | {MANIFEST: json.dumps(manifest).encode()}))


def test_bombs_are_not_unpacked(
    packed: Packed, refused: Callable[[bytes], str], monkeypatch: pytest.MonkeyPatch
) -> None:
    run_id, content = packed.run_id, packed.content
    files = unzipped(content)
    zeros = files | {f"{run_id}/run.json": bytes(parcel.MAX_TEXT + 1)}
    bomb = zipped(signed(zeros), compression=zipfile.ZIP_DEFLATED)
    assert len(bomb) < 4 << 20
    assert "of 16 MB" in refused(bomb)
    many = {f"{run_id}/{number}": b"" for number in range(20_000)}
    assert "lists more files" in refused(zipped(files | many))
    monkeypatch.setattr(parcel, "MAX_UNPACKED", 1000)
    assert "would unpack to more" in refused(content)
    monkeypatch.setattr(parcel, "MAX_PACKED", 1000)
    assert "is larger than" in refused(content)


@given(data=st.data())
@settings(max_examples=60, deadline=None)
def test_no_damage_gets_in_or_out_as_a_traceback(
    data: st.DataObject, packed: Packed, tmp_path_factory: pytest.TempPathFactory
) -> None:
    content = bytearray(packed.content)
    for _ in range(data.draw(st.integers(1, 8))):
        # The ends are where a zip file says what it holds.
        back = data.draw(st.integers(1, 2500))
        content[-back] = data.draw(st.integers(0, 255))
    folder = tmp_path_factory.mktemp("damage")
    path = folder / "x.zip"
    path.write_bytes(bytes(content))
    store = RunStore(folder / "store")
    try:
        (record,) = unpack(store, path)
    except InputError:
        assert store.records() == []
    else:
        run_json = store.root / "runs" / record.id / "run.json"
        assert read_json(run_json)["record"] == packed.store.get(packed.run_id).to_dict()
    finally:
        store.close()
