"""A run's recording: what is in it, how it streams, how it is kept."""

import asyncio
import getpass
import re
import socket
import threading
import time
from pathlib import Path

import httpx
import numpy as np
import pyarrow as pa
import pytest
from fastapi import FastAPI
from rerun.chunk import Chunk, RrdReader
from scenes_support import Flown, Site

from app.scenes import rerun_viewer
from app.scenes.recording import APPLICATION, write_recording
from core.channels import CHANNEL_NAMES, CHANNELS
from core.diagnosis.diagnosis import Diagnosis
from core.errors import MirrorTwinError, StoreError
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.jobs.events import SAMPLE_STRIDE
from core.paths import ROOT
from core.report.case.case import open_case
from core.report.grounded import grounded_template
from core.store.store import RunStore
from core.twin.trajectory import Pair, Trajectory

SCALARS = "Scalars:scalars"
NAMES = "SeriesLines:names"


@pytest.fixture(scope="session")
def diagnosis() -> Diagnosis:
    """A verdict: fuel starvation, quite sure."""
    classes = tuple(catalogue())
    probabilities = np.full(len(classes), 0.01, dtype=np.float32)
    probabilities[classes.index("engine_failure")] = 0.81
    return Diagnosis(
        classes, np.array([90.0]), probabilities[None], probabilities, (), 41.0, "cnn", "lab"
    )


@pytest.fixture(scope="session")
def chunks(
    flown: Flown, diagnosis: Diagnosis, tmp_path_factory: pytest.TempPathFactory
) -> list[Chunk]:
    """All chunks of the compact recording of `flown`."""
    path = tmp_path_factory.mktemp("recording") / "run.rrd"
    write_recording(path, flown.pair, flown.plan, flown.fault, diagnosis)
    return read(path)


def read(path: Path) -> list[Chunk]:
    """The chunks of all recordings in a file."""
    return list(RrdReader(str(path)).stream().to_chunks())


def scalars(chunks: list[Chunk]) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Every plotted entity: times [s] (n,) and values (n, width)."""
    found: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for chunk in chunks:
        batch = chunk.to_record_batch()
        if SCALARS in batch.schema.names:
            time_s = batch.column("t").cast(pa.int64()).to_numpy() / 1e9
            values = batch.column(SCALARS)
            rows = values.flatten().to_numpy().reshape(len(time_s), -1)
            found.setdefault(chunk.entity_path, []).append((time_s, rows))
    return {
        path: (np.concatenate([t for t, _ in parts]), np.concatenate([v for _, v in parts]))
        for path, parts in found.items()
    }


def text_of(chunks: list[Chunk]) -> str:
    """Everything in a recording that could be read: names, metadata, and all but long columns."""
    batches = [chunk.to_record_batch() for chunk in chunks]
    return "\n".join(
        f"{batch.schema} {batch.schema.metadata} {batch.to_pydict() if len(batch) < 50 else ''}"
        for batch in batches
        if "Asset3D:blob" not in batch.schema.names
    )


def test_every_channel_has_its_two_named_lines_at_50_hz(chunks: list[Chunk], flown: Flown) -> None:
    names = {
        chunk.entity_path: chunk.to_record_batch().column(NAMES).flatten().to_pylist()
        for chunk in chunks
        if NAMES in chunk.to_record_batch().schema.names
    }
    plotted = scalars(chunks)
    seen: list[str] = []
    for path in (path for path in plotted if path.startswith("/channels/")):
        time_s, values = plotted[path]
        np.testing.assert_allclose(time_s, flown.pair.mirror.time_s, atol=1e-8)
        labels = names[path]
        assert len(labels) == values.shape[1]
        half = len(labels) // 2
        assert set(labels[:half]) == {"mirror"}
        for column, label in enumerate(labels[half:]):
            name = next(channel.name for channel in CHANNELS if channel.label == label)
            np.testing.assert_array_equal(values[:, column], flown.pair.mirror.channel(name))
            np.testing.assert_array_equal(
                values[:, half + column], flown.pair.faulted.channel(name)
            )
            seen.append(name)
    assert sorted(seen) == sorted(CHANNEL_NAMES)
    assert len(plotted) < 20, "Rerun pays by entity"


def test_residuals_are_percent_of_the_gauge(chunks: list[Chunk], flown: Flown) -> None:
    time_s, values = scalars(chunks)["/residuals"]
    assert values.shape == (len(time_s), len(CHANNELS))
    assert np.all(values[time_s < flown.fault.onset_s] == 0.0)
    rpm = CHANNEL_NAMES.index("E1 RPM")
    expected = flown.pair.residual[::5, rpm] / CHANNELS[rpm].full_scale * 100.0
    np.testing.assert_allclose(values[:, rpm], expected, rtol=1e-5)
    assert values[-1, rpm] < -20.0


def test_both_aircraft_fly(chunks: list[Chunk]) -> None:
    ends = {}
    for chunk in chunks:
        batch = chunk.to_record_batch()
        if "Transform3D:translation" in batch.schema.names:
            ends[chunk.entity_path] = batch.column("Transform3D:translation")[-1].as_py()[0]
    assert set(ends) == {"/scene/faulted", "/scene/mirror"}
    assert ends["/scene/faulted"][2] < ends["/scene/mirror"][2] - 0.5, "it sinks, drawn x5, in km"


def test_plan_fault_and_verdict_are_told(chunks: list[Chunk]) -> None:
    text = text_of(chunks)
    for told in ("Engine failure", "Severity 0.8, from 40 s on", "5,000 ft", "seed 5", "81.0%"):
        assert told in text
    properties = {c.entity_path: c.to_record_batch().to_pydict() for c in chunks if c.is_static}
    assert properties["/__properties/plan"]["heading_deg"] == [[350.0]]
    assert properties["/__properties/fault"]["mode"] == [["engine_failure"]]


def test_nothing_personal_is_in_it(chunks: list[Chunk]) -> None:
    text = text_of(chunks)
    words = [getpass.getuser(), socket.gethostname(), str(Path.home()), str(ROOT), "pytest"]
    for word in words:
        assert not re.search(rf"\b{re.escape(word)}\b", text), word
    assert "start_time" not in text


def test_a_five_minute_recording_is_well_under_13_mb(flown: Flown, tmp_path: Path) -> None:
    whole = Pair(*(Trajectory.joined([part, part, part[:3000]]) for part in (
        flown.pair.faulted, flown.pair.mirror)))  # fmt: skip
    time_s = np.arange(15000) / 50.0
    whole = Pair(*(
        Trajectory(time_s, part.states, part.channels) for part in (whole.faulted, whole.mirror)
    ))  # fmt: skip
    path = tmp_path / "run.rrd"
    write_recording(path, whole, flown.plan, flown.fault)
    assert 3e6 < path.stat().st_size < 10e6


def test_recordings_leave_no_threads_behind(flown: Flown, tmp_path: Path) -> None:
    def threads() -> int:
        return len(list(Path("/proc/self/task").iterdir()))

    write_recording(tmp_path / "run.rrd", flown.pair, flown.plan, flown.fault)
    before = threads()
    for _ in range(4):
        write_recording(tmp_path / "run.rrd", flown.pair, flown.plan, flown.fault)
    # Each would leave four; a test beside this one may be ending a thread of its own.
    assert threads() <= before + 2


def test_a_nominal_run_has_no_onset(flown: Flown, tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    same = Pair(flown.pair.mirror, flown.pair.mirror)
    write_recording(path, same, flown.plan, Fault())
    assert not any(chunk.entity_path.startswith("/scene/onset") for chunk in read(path))


def test_an_unwritable_place_is_said_and_keeps_the_old_file(flown: Flown, tmp_path: Path) -> None:
    with pytest.raises(StoreError, match="cannot write to"):
        write_recording(tmp_path / "none" / "run.rrd", flown.pair, flown.plan, flown.fault)
    assert list(tmp_path.iterdir()) == []


# -- served ----------------------------------------------------------------------------------------


def test_a_live_recording_grows_and_then_is_a_file(
    site: Site, store: RunStore, flown: Flown, diagnosis: Diagnosis, tmp_path: Path
) -> None:
    run = store.create(flown.plan, flown.fault).id
    url = f"{site.url}/recordings/{run}.rrd"
    recording = site.recordings.open(run)
    batches = flown.samples()
    parts: list[bytes] = []

    def listen() -> None:
        with httpx.stream("GET", url) as response:
            assert response.headers["access-control-allow-origin"] == "*"
            parts.extend(response.iter_raw())

    listener = threading.Thread(target=listen)
    listener.start()
    recording.extend(batches[0])
    deadline = time.monotonic() + 10.0
    while len(recording._chunks) < 2 or sum(map(len, parts)) < sum(map(len, recording._chunks)):
        assert time.monotonic() < deadline, "nothing came while the run was flown"
        time.sleep(0.02)
    for samples in [*batches[1:], *batches]:  # a second attempt flies the same again
        recording.extend(samples)
    recording.finish(diagnosis)
    listener.join(10.0)
    assert not listener.is_alive()

    assert b"".join(parts) == b"".join(recording._chunks)
    streamed = []
    for index, content in enumerate(recording._chunks):  # each is a whole RRD in itself
        path = tmp_path / f"{index}.rrd"
        path.write_bytes(content)
        streamed += read(path)
    time_s, _ = scalars(streamed)["/channels/RPM"]
    thin_s = flown.pair.mirror.time_s[::SAMPLE_STRIDE]
    np.testing.assert_allclose(time_s, thin_s, atol=1e-4)
    assert "81.0%" in text_of(streamed)
    assert sum(map(len, parts)) < 3e6

    store.save_recording(
        run, lambda path: write_recording(path, flown.pair, flown.plan, flown.fault, diagnosis)
    )
    stored = httpx.get(url)
    assert stored.content == store.recording_path(run).read_bytes()
    assert httpx.head(url).headers["access-control-allow-origin"] == "*"


def test_a_run_that_never_flew_still_has_a_scene(site: Site, store: RunStore, flown: Flown) -> None:
    run = store.create(flown.plan, flown.fault).id
    site.recordings.open(run).finish(None)
    response = httpx.get(f"{site.url}/recordings/{run}.rrd")
    assert response.content.startswith(b"RRF2")


def test_a_cancelled_run_still_shows_what_was_flown(
    site: Site, store: RunStore, flown: Flown
) -> None:
    run = store.create(flown.plan, flown.fault).id
    recording = site.recordings.open(run)
    recording.extend(flown.samples()[0])
    recording.finish(None)
    content = httpx.get(f"{site.url}/recordings/{run}.rrd").content
    assert content == b"".join(recording._chunks)
    assert len(recording._chunks) == 2


def test_a_recording_that_was_lost_or_damaged_is_made_again(
    site: Site, store: RunStore, flown: Flown, diagnosis: Diagnosis
) -> None:
    run = store.create(flown.plan, flown.fault).id
    store.save_pair(run, flown.pair)
    store.save_result(run, diagnosis, grounded_template(open_case(diagnosis)))
    url, path = f"{site.url}/recordings/{run}.rrd", store.recording_path(run)
    whole = httpx.get(url).content
    assert whole == path.read_bytes()
    damaged = whole[:5000] + bytes([whole[5000] ^ 1]) + whole[5001:]
    for harm in (lambda: path.write_bytes(damaged), path.unlink):
        harm()
        again = httpx.get(url).content
        assert again == path.read_bytes() != damaged
        assert store.has_recording(run)
    path.unlink()
    parquet = path.with_name("run.parquet")
    content = parquet.read_bytes()
    parquet.write_bytes(content[:5000] + bytes([content[5000] ^ 1]) + content[5001:])
    answer = httpx.get(url)
    assert answer.status_code == 404
    assert "run.parquet is damaged (checksum); fly it again" in answer.text


@pytest.mark.parametrize(
    "name", ["20261123T061500-k3x9q2wz", "nonsense", "..%2f..%2findex.sqlite", "%00"]
)
def test_no_such_recording(site: Site, name: str) -> None:
    for method in ("GET", "HEAD"):
        response = httpx.request(method, f"{site.url}/recordings/{name}.rrd")
        assert response.status_code == 404


# -- the viewer ------------------------------------------------------------------------------------


def test_the_viewer_page_may_reach_nothing_but_this_server(site: Site) -> None:
    page = httpx.get(f"{site.url}/rerun/viewer.html?theme=dark&url=/recordings/x.rrd")
    assert page.status_code == 200
    assert 'data-theme="dark"' in page.text
    policy = page.headers["content-security-policy"]
    assert f"connect-src {site.url};" in policy
    assert set(re.findall(r"https?://[^ ;]+", policy)) == {site.url}


def test_the_theme_is_never_written_as_given(site: Site) -> None:
    page = httpx.get(f"{site.url}/rerun/viewer.html", params={"theme": '"><script>'})
    assert 'data-theme="light"' in page.text


def test_the_viewer_files_have_their_types_and_may_be_kept(site: Site) -> None:
    base = f"{site.url}/rerun/{rerun_viewer.VERSION}"
    widget = httpx.get(f"{base}/widget.js")
    assert widget.headers["content-type"].startswith("text/javascript")
    assert "immutable" in widget.headers["cache-control"]
    assert "export { WebViewer };" in widget.text
    with httpx.stream("GET", f"{base}/re_viewer_bg.wasm") as wasm:
        assert wasm.headers["content-type"] == "application/wasm"
        assert next(wasm.iter_raw(4)) == b"\0asm"


def test_a_narrow_window_gets_a_layout_of_its_own(site: Site) -> None:
    answer = httpx.get(f"{site.url}/rerun/narrow.rbl")
    assert answer.headers["access-control-allow-origin"] == "*"
    assert answer.content.startswith(b"RRF2")
    assert APPLICATION.encode() in answer.content


@pytest.mark.slow
def test_the_viewer_travels_packed_over_a_network() -> None:
    app = FastAPI()
    rerun_viewer.mount(app)

    async def fetch() -> httpx.Response:
        elsewhere = httpx.ASGITransport(app, client=("192.0.2.7", 4711))
        async with httpx.AsyncClient(transport=elsewhere, base_url="http://site") as client:
            return await client.get(f"/rerun/{rerun_viewer.VERSION}/re_viewer_bg.wasm")

    response = asyncio.run(fetch())
    assert int(response.headers["content-length"]) < 20e6
    assert response.content == (rerun_viewer.viewer_files() / "re_viewer_bg.wasm").read_bytes()


@pytest.mark.parametrize("found", [None, "0.40.0"])
def test_a_missing_or_wrong_viewer_is_named(
    monkeypatch: pytest.MonkeyPatch, site: Site, found: str | None
) -> None:
    rerun_viewer.viewer_files.cache_clear()
    if found is None:
        monkeypatch.setattr(rerun_viewer, "find_spec", lambda name: None)
    else:
        monkeypatch.setattr(rerun_viewer, "version", lambda name: found)
    with pytest.raises(MirrorTwinError, match=r"pip install --no-deps rerun-notebook==0\.41\.0"):
        rerun_viewer.viewer_files()
    page = httpx.get(f"{site.url}/rerun/viewer.html")
    assert page.status_code == 503
    assert "rerun-notebook" in page.text
