"""A run as a Rerun recording: what is in it, and the compact file kept in the store.

Rerun's cost is per chunk and entity, not per number: 60 channels logged one by one make 156 MB,
the same in wide columns 13 MB. So channels that share an axis share an entity, and everything is
sent as columns. The drawn world is that of `app.scenes.geometry`.
"""

import hashlib
import json
import threading
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import rerun as rr
import rerun_bindings
from numpy.typing import ArrayLike, NDArray

from app import theme
from app.scenes import geometry
from app.scenes.geometry import Array, Poses, drawn_height, drawn_positions
from app.scenes.mesh import WINGSPAN_M, aircraft_glb
from app.scenes.palette import FAULTED, MIRROR, Rgb, rgb
from app.scenes.rerun_blueprint import PLOTS, TIMELINE, Plot, blueprint, narrow_blueprint
from core.channels import CHANNELS
from core.clock import DT_S
from core.diagnosis.diagnosis import Diagnosis
from core.errors import StoreError
from core.files import whole_file
from core.fmea.catalogue import catalogue
from core.fmea.fault import Fault
from core.twin.plan import Plan
from core.twin.trajectory import Pair

APPLICATION = "mirrortwin"
_READ_TIMEOUT_S = 30.0
_VIEWER_ASPECT = 1.2
_VIEWER_FOV = float(np.radians(55.0))
"""The vertical field of view of Rerun's camera, which a blueprint cannot change."""

_DRAWN_POINTS = 900
_RESIDUAL_STRIDE = 5
"""Residuals follow from the channels, which are kept at 50 Hz: 10 Hz is enough to see them."""

_PAINTS: dict[str, Rgb] = {"mirror": MIRROR, "faulted": FAULTED}
_FULL_SCALE = np.array([channel.full_scale for channel in CHANNELS])

Matrix = NDArray[np.floating]


def write_recording(
    path: Path, pair: Pair, plan: Plan, fault: Fault, diagnosis: Diagnosis | None = None
) -> None:
    """Write a whole run as one compact ``.rrd``, whole or not at all; raises `StoreError`.

    About 6 MB for 300 s. Takes a few tenths of a second: not for an event loop.
    """
    settings = json.dumps([plan.to_dict(), fault.to_dict()], sort_keys=True)
    log = RunLog(hashlib.sha256(settings.encode()).hexdigest()[:16])
    faulted, mirror = Poses.of_flight(pair.faulted), Poses.of_flight(pair.mirror)
    # The ground may have ended it before its plan did.
    flown_s = min(plan.duration_s, len(pair.mirror) * DT_S)
    log.begin(plan, geometry.lowest_ft(faulted, mirror), flown_s)
    log.describe(plan, fault, diagnosis)
    log.poses(faulted, mirror)
    log.paths(faulted, mirror, growing=False)
    if fault.mode != "nominal":
        log.onset(faulted.at(fault.onset_s))
    # The bulk comes last, so that a viewer shows the flight while it still loads.
    log.channels(pair.mirror.time_s, pair.faulted.channels, pair.mirror.channels)
    thin = pair[::_RESIDUAL_STRIDE]
    log.residuals(thin.mirror.time_s, thin.faulted.channels, thin.mirror.channels)
    content = log.read()
    log.close()
    with whole_file(path) as temporary:
        temporary.write_bytes(content)


class RunLog:
    """Writes one run into a Rerun recording and hands out its bytes. Not thread-safe.

    Nothing in it says who flew it or where: only plan, fault, flights and diagnosis.
    """

    def __init__(self, recording_id: str) -> None:
        """Begin an empty recording."""
        self._recording = rr.RecordingStream(
            APPLICATION, recording_id=recording_id, send_properties=False
        )
        self._bytes = rr.binary_stream(recording=self._recording)
        self._origin_ft = 0.0
        self._floor_km = 0.0

    def read(self) -> bytes:
        """What has been logged since the last read: RRD bytes, which may simply be concatenated.

        Raises `StoreError` if Rerun does not finish encoding.
        """
        content = self._bytes.read(flush=True, flush_timeout_sec=_READ_TIMEOUT_S)
        if content is None:
            raise StoreError("the recording could not be encoded")
        return content

    def close(self) -> None:
        """Let go of its threads and memory: nothing can be logged or read any more.

        Rerun itself only disconnects a recording that nobody holds (its issue 2116).
        """
        del self._recording, self._bytes
        rerun_bindings.flush_and_cleanup_orphaned_recordings()

    def begin(self, plan: Plan, lowest_ft: float, flown_s: float | None = None) -> None:
        """Log what does not change: layout, aircraft, names and colours of the channels.

        ``lowest_ft``: the lowest altitude known so far; the ground is drawn below it. ``flown_s``:
        how long the flight is, as long as its plan where that is not known.
        """
        flown_s = plan.duration_s if flown_s is None else flown_s
        self._origin_ft = plan.altitude_ft
        self._floor_km = drawn_height(geometry.floor_ft(lowest_ft), self._origin_ft).item()
        stage = geometry.expected_points(Poses.start(plan), flown_s)
        lowest = drawn_height(lowest_ft, self._origin_ft)
        stage[:, 2] = np.minimum(stage[:, 2], np.where(stage[:, 2] < 0.0, lowest, stage[:, 2]))
        camera = geometry.framed(stage, plan.heading_deg, _VIEWER_ASPECT, _VIEWER_FOV)
        _send_blueprint(self._recording, blueprint(camera, self._floor_km, flown_s))
        self._static("/scene", rr.ViewCoordinates.RIGHT_HAND_Z_UP)
        scale = geometry.wingspan_km(camera) / WINGSPAN_M
        for name, paint in _PAINTS.items():
            glb = aircraft_glb(paint, 0.6 if name == "mirror" else 1.0)
            body = rr.Asset3D(contents=glb, media_type="model/gltf-binary")
            self._static(f"/scene/{name}/body", body)
            self._static(f"/scene/{name}/body", rr.Transform3D(scale=scale))
        for plot in PLOTS:
            self._static(plot.path, _series(plot))
        names = [channel.label for channel in CHANNELS]
        self._static("/residuals", rr.SeriesLines(names=names, widths=[1.2]))

    def describe(self, plan: Plan, fault: Fault, diagnosis: Diagnosis | None) -> None:
        """Log plan, fault and diagnosis, as text for people and as properties for programs."""
        mode = catalogue()[fault.mode]
        self._recording.send_recording_name(mode.name)
        self._recording.send_property("plan", rr.AnyValues(**_flat(plan.to_dict())))
        self._recording.send_property("fault", rr.AnyValues(**_flat(fault.to_dict())))
        if diagnosis is not None:
            ranked = dict(diagnosis.ranked(3))
            self._recording.send_property("diagnosis", rr.AnyValues(**_flat(ranked)))
        text = _notes(plan, fault, diagnosis)
        self._static("/run", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN))

    def channels(self, time_s: ArrayLike, faulted: Matrix, mirror: Matrix) -> None:
        """Log channels (n, n_channels) of both flights."""
        time = rr.TimeColumn(TIMELINE, duration=np.asarray(time_s, dtype=np.float64))
        for plot in PLOTS:
            columns = list(plot.columns)
            # The mirror first: the faulted line is drawn over it.
            self._scalars(plot.path, time, np.hstack([mirror[:, columns], faulted[:, columns]]))

    def residuals(self, time_s: ArrayLike, faulted: Matrix, mirror: Matrix) -> None:
        """Log faulted minus mirror of channels (n, n_channels), in percent of each gauge's span."""
        time = rr.TimeColumn(TIMELINE, duration=np.asarray(time_s, dtype=np.float64))
        self._scalars("/residuals", time, (faulted - mirror) / _FULL_SCALE * 100.0)

    def poses(self, faulted: Poses, mirror: Poses) -> None:
        """Log where both aircraft are."""
        for name, poses in (("faulted", faulted), ("mirror", mirror)):
            time = rr.TimeColumn(TIMELINE, duration=poses.time_s)
            columns = rr.Transform3D.columns(
                translation=drawn_positions(poses, self._origin_ft),
                quaternion=np.roll(geometry.attitude(poses), -1, axis=1),
            )
            self._recording.send_columns(f"/scene/{name}", [time], columns)

    def paths(self, faulted: Poses, mirror: Poses, *, growing: bool) -> None:
        """Log both paths and the gap between them; ``growing`` ones are true only from now on."""
        solid = drawn_positions(faulted.thinned(_DRAWN_POINTS), self._origin_ft)
        lines: dict[str, tuple[Array, Rgb, float]] = {
            "/scene/paths/faulted": (solid[None], FAULTED, 1.5),
            "/scene/paths/mirror": (geometry.dashes(mirror, self._origin_ft), MIRROR, 2.2),
            "/scene/paths/gap": (geometry.rungs(faulted, mirror, self._origin_ft), FAULTED, 0.5),
        }
        if growing:
            self._recording.set_time(TIMELINE, duration=float(mirror.time_s[-1]))
        vertices, faces = geometry.gap(faulted, mirror, self._origin_ft)
        self._recording.log(
            "/scene/paths/surface",
            rr.Mesh3D(
                vertex_positions=vertices, triangle_indices=faces, albedo_factor=(*FAULTED, 40)
            ),
            static=not growing,
        )
        for path, (strips, colour, radius) in lines.items():
            strip = rr.LineStrips3D(list(strips), colors=[colour], radii=-radius)
            self._recording.log(path, strip, static=not growing)

    def onset(self, pose: Poses) -> None:
        """Mark where the fault begins: a post from the ground to the path."""
        top = drawn_positions(pose, self._origin_ft)[0]
        foot = np.array([top[0], top[1], self._floor_km])
        colour = rgb(theme.ONSET)
        self._static("/scene/onset", rr.LineStrips3D([[foot, top]], colors=[colour], radii=-1.0))
        self._static(
            "/scene/onset/label",
            rr.Points3D([foot], colors=[colour], radii=-2.0, labels=["Fault begins"]),
        )

    def _static(self, path: str, content: rr.AsComponents) -> None:
        self._recording.log(path, content, static=True)

    def _scalars(self, path: str, time: rr.TimeColumn, values: Matrix) -> None:
        rows, width = values.shape
        columns = rr.Scalars.columns(scalars=values.ravel()).partition(np.full(rows, width))
        self._recording.send_columns(path, [time], columns)


_BLUEPRINTS = threading.Lock()


@cache
def _blueprint_stream() -> rr.RecordingStream:
    """One for all blueprints: Rerun never gives up one of these, nor its thread and megabyte."""
    native = rerun_bindings.new_blueprint(
        APPLICATION, make_default=False, make_thread_default=False
    )
    return rr.RecordingStream._from_native(native)


def _send_blueprint(recording: rr.RecordingStream, layout: rr.blueprint.Blueprint) -> None:
    """As ``recording.send_blueprint`` does it, which opens a new stream every time."""
    with _BLUEPRINTS:
        stream = _blueprint_stream()
        stream.set_time("blueprint", sequence=0)
        layout._log_to_stream(stream)
        held = stream.memory_recording().storage
        rerun_bindings.send_blueprint(held, True, True, recording=recording.to_native())


@cache
def narrow_layout() -> bytes:
    """The layout for narrow windows as a file: opened after a recording, it replaces its own."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "narrow.rbl"
        narrow_blueprint().save(APPLICATION, str(path))
        return path.read_bytes()


def _series(plot: Plot) -> rr.SeriesLines:
    """Names and looks of a plot's lines: the mirrors' first, then the faulted flight's."""
    labels = [channel.label for channel in plot.channels]
    several = len(labels) > 1
    faulted = (
        [rgb(colour) for colour in theme.CLASS_COLOURS[: len(labels)]] if several else [FAULTED]
    )
    return rr.SeriesLines(
        names=["mirror"] * len(labels) + labels,
        colors=[MIRROR] * len(labels) + faulted,
        widths=[2.5] * len(labels) + [1.2] * len(labels),
    )


def _flat(values: Mapping[str, Any]) -> dict[str, Any]:
    """Nested tables as one, without the empty fields: Rerun's properties are plain values."""
    flat: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, dict):
            flat |= {f"{name}_{inner}": item for inner, item in _flat(value).items()}
        elif value is not None:
            flat[name] = value
    return flat


def _notes(plan: Plan, fault: Fault, diagnosis: Diagnosis | None) -> str:
    """Plan, fault and diagnosis in Markdown."""
    modes = catalogue()
    lines = [f"# {modes[fault.mode].name}"]
    if fault.mode != "nominal":
        lines.append(f"Severity {fault.severity:g}, from {fault.onset_s:g} s on.")
    lines.append(
        f"\nBoth aircraft are a simulated Cessna 172P at {plan.altitude_ft:,.0f} ft and "
        f"{plan.speed_kt:g} kt on heading {plan.heading_deg:g}\N{DEGREE SIGN} for "
        f"{plan.duration_s:g} s, {plan.conditions} conditions, seed {plan.seed}."
    )
    if diagnosis is not None:
        lines.append("\n## Diagnosis\n")
        lines += [f"- {modes[mode].name}: {share:.1%}" for mode, share in diagnosis.ranked(3)]
    return "\n".join(lines)
