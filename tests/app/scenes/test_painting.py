"""Colours of the path, and the cameras that go along."""

from dataclasses import replace

import numpy as np
import pytest
from scenes_support import Flown

from app import theme
from app.scenes import geometry
from app.scenes.cameras import VIEWS, apart_m, apart_words, following
from app.scenes.geometry import Poses
from app.scenes.painting import (
    READING_STOPS,
    Paint,
    Readings,
    choices,
    colours_at,
    legend_of,
    scale_of,
)
from app.scenes.palette import FAULTED, linear_light, rgb
from app.scenes.viser_scene import ViserScene
from core.channels import CHANNELS
from core.errors import InputError

RPM = Paint("E1 RPM", "reading")
RPM_RESIDUAL = Paint("E1 RPM", "residual")


def readings_of(flown: Flown) -> Readings:
    thin = flown.pair[::10]
    return Readings(thin.mirror.time_s, thin.faulted.channels, thin.mirror.channels)


def test_everything_that_can_be_chosen_is_read_back() -> None:
    values = [item["value"] for group in choices() for item in group["items"]]  # type: ignore[attr-defined]
    assert len(values) == len(set(values)) == 2 * len(CHANNELS)
    for value in values:
        paint = Paint.read(value)
        assert paint is not None and paint.text == value
    assert Paint.read(None) is Paint.read("") is None
    for text in ("residual:nonsense", "E1 RPM", "html:<b>"):
        with pytest.raises(InputError):
            Paint.read(text)


def test_colours_follow_the_reading(flown: Flown) -> None:
    readings = readings_of(flown)
    low, _ = scale_of(RPM, readings)
    assert low == pytest.approx(readings.values(RPM).min())
    times = readings.time_s[[0, -1]]
    first, last = colours_at(RPM, readings, times)
    assert first.tolist() != last.tolist()
    slowest = readings.time_s[readings.values(RPM).argmin()]
    assert tuple(colours_at(RPM, readings, [slowest])[0]) == rgb(READING_STOPS[0])
    legend = legend_of(RPM, readings)
    assert legend.low.endswith("rpm") and legend.low < legend.high


def test_a_residual_is_grey_until_the_fault_and_blue_below_the_mirror(flown: Flown) -> None:
    readings = readings_of(flown)
    low, high = scale_of(RPM_RESIDUAL, readings)
    assert low == -high
    before, after = colours_at(RPM_RESIDUAL, readings, [10.0, 100.0]).astype(int)
    assert np.ptp(before) < 30
    assert after[2] > after[0] + 60  # blue: the engine has slowed
    quiet = replace(readings, faulted=readings.mirror)
    assert np.ptp(colours_at(RPM_RESIDUAL, quiet, [10.0])[0].astype(int)) < 30
    assert legend_of(RPM_RESIDUAL, readings).high.startswith("+")


def test_the_scale_rises_evenly_in_lightness_and_uses_no_colour_of_status() -> None:
    lightness = [0.2126 * r + 0.7152 * g + 0.0722 * b for r, g, b in map(rgb, READING_STOPS)]
    steps = np.diff(lightness)
    assert (steps > 0).all() and steps.max() < 3.0 * steps.min()
    assert theme.STATUS_RED not in READING_STOPS


def test_cameras_go_along(flown: Flown) -> None:
    faulted, mirror = (
        Poses.of_flight(flight).at(100.0) for flight in (flown.pair.faulted, flown.pair.mirror)
    )
    origin_ft = float(flown.pair.mirror.states[0, 2])
    points = np.concatenate(
        [geometry.drawn_positions(pose, origin_ft) for pose in (faulted, mirror)]
    )
    side = following("side", faulted, mirror, origin_ft, 0.2)
    assert geometry.in_view(side, points, aspect=1.0)
    chase = following("chase", faulted, mirror, origin_ft, 0.2)
    assert geometry.in_view(chase, points[:1], aspect=1.0)
    heading = np.radians(faulted.values[0, 5])
    looks = np.subtract(chase.look_at, chase.position)
    assert looks[:2] @ [np.sin(heading), np.cos(heading)] > 0.95 * np.linalg.norm(looks)


def test_the_way_between_both_is_measured_at_true_scale(flown: Flown) -> None:
    faulted, mirror = (
        Poses.of_flight(flight) for flight in (flown.pair.faulted, flown.pair.mirror)
    )
    assert apart_words(apart_m(faulted.at(10.0), mirror.at(10.0))) == ""
    states = [flight.states[5000] for flight in (flown.pair.faulted, flown.pair.mirror)]
    expected = np.linalg.norm((states[0] - states[1])[:3] * [1.0, 1.0, 0.3048])
    assert apart_m(faulted.at(100.0), mirror.at(100.0)) == pytest.approx(expected, rel=0.01)


def test_a_scene_is_painted_live_and_whole_and_turned_to_every_view(flown: Flown) -> None:
    scene = ViserScene()
    scene.watch()
    try:
        assert scene.legend() is None
        scene.paint(RPM_RESIDUAL)
        for samples in flown.samples():
            scene.extend(samples)
        live = scene.legend()
        scene.show(flown.pair, flown.fault.onset_s)
        whole = scene.legend()
        assert live is not None and whole is not None
        assert live.stops == whole.stops
        line = scene._drawing._lines["/faulted/path"]
        assert line.colors.shape == line.points.shape
        text = scene._drawing._labels["faulted"].text
        assert "apart" in text
        assert scene._drawing._labels["faulted"].anchor == "top-right", "at the edge of the view"
        scene.seek(10.0)
        assert scene._drawing._labels["faulted"].anchor == "top-left"
        assert "apart" not in scene._drawing._labels["faulted"].text
        for view in VIEWS:
            scene.look(view)
        with pytest.raises(InputError):
            scene.look("upside down")  # type: ignore[arg-type]
        scene.paint(None)
        assert scene.legend() is None
        faulted = linear_light(np.array([FAULTED], dtype=np.uint8))
        assert np.unique(line.colors.reshape(-1, 3), axis=0).tolist() == faulted.tolist()
        scene.reset(60.0)
        assert "/curtain" not in scene._drawing._ribbons
    finally:
        scene.stop()
