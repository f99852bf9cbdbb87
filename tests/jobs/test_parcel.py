"""Runs packed and unpacked: the same runs again, and nothing else gets in."""

import hashlib
import io
import json
import zipfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from jobs_support import CRACK, SHORT_PLAN

from core.diagnosis.predict import load_diagnoser
from core.errors import InputError, StoreError
from core.jobs import parcel
from core.jobs.files import read_json
from core.jobs.keeping import Label, delete, discard, label_of, write_label
from core.jobs.parcel import MANIFEST, pack, unpack
from core.jobs.store import RunStore
from core.report.template import write_report
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
    store.save_result(run_id, diagnosis, write_report(diagnosis))
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
        inner = values
        for step in path[:-1]:
            inner = inner[step]
        inner[path[-1]] = value
        return why("run.json", json.dumps(values).encode())

    assert "not a flight" in why("run.parquet", b"PAR1 not at all PAR1")
    assert "not a recording" in why("run.rrd", b"MZ")
    assert "not the record" in why("run.json", b"{}")
    assert "not the record" in why("run.json", b"[" * 100_000)
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
