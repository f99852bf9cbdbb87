"""Figures and tiles: valid for Plotly, true to the data, light on the wire."""

from base64 import b64decode

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plotly import graph_objects as go

from app.figures.axes import kept_rows, moment, moments, onset_mark, packed, time_axis
from app.figures.probabilities import leaders, probability_figure
from app.figures.residuals import NOISE_SIGMA, TIME_BINS, binned_sigma, heat_strip
from app.figures.sensors import decimated, tile_specs
from app.pages.fly import page as fly
from core.channels import CHANNEL_INDEX, CHANNELS, N_CHANNELS
from core.clock import clock
from core.fmea.catalogue import catalogue
from core.twin.trajectory import STATE_NAMES, Pair, Trajectory

NAMES = {mode.id: mode.name for mode in catalogue().values()}


def floats(text: str) -> np.ndarray:
    return np.frombuffer(b64decode(text), dtype=np.float32)


def made_up_pair(n: int = 15_000) -> Pair:
    rng = np.random.default_rng(3)
    time_s = np.arange(n) / 50.0
    states = np.zeros((n, len(STATE_NAMES)))
    mirror = rng.normal(100.0, 1.0, (n, N_CHANNELS)).astype(np.float32)
    faulted = mirror.copy()
    faulted[7_000, 4] += 500.0
    return Pair(Trajectory(time_s, states, faulted), Trajectory(time_s, states, mirror))


@pytest.mark.parametrize(
    ("seconds", "text"), [(0, "0:00"), (75.4, "1:15"), (599.6, "10:00"), (3725, "1:02:05")]
)
def test_time_reads_as_minutes_and_seconds(seconds: float, text: str) -> None:
    assert clock(seconds) == text


def test_an_hour_long_axis_shows_hours() -> None:
    assert time_axis(300.0)["tickformat"] == "%-M:%S"
    assert time_axis(7200.0)["tickformat"] == "%-H:%M:%S"


def test_packed_arrays_are_read_back_by_plotly() -> None:
    values = np.arange(6, dtype=np.float32).reshape(2, 3)
    assert packed(values)["shape"] == "2, 3"
    assert floats(packed(values)["bdata"]).tolist() == [0, 1, 2, 3, 4, 5]


def test_flight_times_are_dates_that_no_time_zone_shifts() -> None:
    times_s = np.arange(0.0, 7200.0, 0.02)
    texts = moments(times_s)
    assert texts[:2] == ["1970-01-01T00:00:00.000", "1970-01-01T00:00:00.020"]
    read_back = np.array(texts, dtype="datetime64[ms]").astype(np.int64) / 1000.0
    np.testing.assert_allclose(read_back, times_s, atol=1e-9)
    assert time_axis(300.0)["range"] == [texts[0], moment(300.0)]
    assert moments(np.empty(0)) == []


def test_decimation_keeps_a_spike_of_one_sample() -> None:
    time_s = np.arange(100_000) / 50.0
    values = np.zeros(100_000)
    values[54_321] = 1.0
    rows = kept_rows(time_s, values, 400)
    assert len(rows) <= 400
    assert 54_321 in rows


@settings(max_examples=30, deadline=None)
@given(st.integers(1_000, 5_000), st.integers(0, 2**32 - 1), st.sampled_from([50, 100, 400]))
def test_decimation_keeps_the_extremes_of_every_stretch(n: int, seed: int, n_out: int) -> None:
    rng = np.random.default_rng(seed)
    time_s = np.arange(n) / 50.0
    values = rng.normal(0.0, 1.0, n) + 50.0 * (rng.random(n) < 0.01) - 50.0 * (rng.random(n) < 0.01)
    rows = kept_rows(time_s, values, n_out)
    assert len(rows) <= n_out
    assert np.all(np.diff(rows) > 0)
    assert (rows[0], rows[-1]) == (0, n - 1)
    bucket = -(-n // ((n_out - 2) // 2)) + 1
    for start in range(0, n - 3 * bucket, bucket):
        stretch = values[start + bucket : start + 2 * bucket]
        kept = values[rows[(rows >= start) & (rows < start + 3 * bucket)]]
        assert kept.max() >= stretch.max()
        assert kept.min() <= stretch.min()


def test_only_a_faulted_run_marks_an_onset() -> None:
    assert onset_mark(None) == []
    (mark,) = onset_mark(60.0)
    assert mark["x0"] == mark["x1"] == moment(60.0)


class TestHeatStrip:
    def test_a_bin_shows_the_value_farthest_from_zero_with_its_sign(self) -> None:
        time_s = np.arange(300) * 1.0
        residual = np.zeros((300, N_CHANNELS))
        residual[10] = 2.0 * NOISE_SIGMA
        residual[12] = 1.0 * NOISE_SIGMA
        residual[13] = -5.0 * NOISE_SIGMA
        strip = binned_sigma(time_s, residual, 300.0)
        assert strip.shape == (N_CHANNELS, TIME_BINS)
        np.testing.assert_allclose(strip[:, 5], [2.0] * N_CHANNELS, rtol=1e-5)
        np.testing.assert_allclose(strip[:, 6], [-5.0] * N_CHANNELS, rtol=1e-5)

    def test_what_is_not_flown_yet_is_blank(self) -> None:
        strip = binned_sigma(np.arange(100.0), np.zeros((100, N_CHANNELS)), 300.0)
        assert not np.isnan(strip[:, :50]).any()
        assert np.isnan(strip[:, 50:]).all()

    def test_it_is_a_valid_figure_with_every_channel_and_the_onset(self) -> None:
        figure = go.Figure(
            heat_strip(np.arange(9.0), np.ones((9, N_CHANNELS)), duration_s=9.0, onset_s=3.0)
        )
        assert list(figure.layout.yaxis.ticktext) == [channel.label for channel in CHANNELS]
        assert figure.layout.shapes[0].x0 == moment(3.0)

    def test_it_is_valid_before_a_flight(self) -> None:
        go.Figure(heat_strip(np.empty(0), np.empty((0, N_CHANNELS)), duration_s=9.0, onset_s=None))


class TestProbabilities:
    def test_leaders_are_ranked_and_ties_keep_class_order(self) -> None:
        shares = np.zeros(len(NAMES))
        shares[[7, 3]] = 0.6, 0.4
        classes = tuple(NAMES)
        assert leaders(classes, shares, 3) == [classes[7], classes[3], classes[0]]

    def test_the_figure_is_valid_and_names_who_leads(self) -> None:
        over_time = np.zeros((30, len(NAMES)), dtype=np.float32)
        over_time[:12, 0], over_time[12:, 5] = 0.9, 0.8
        classes = tuple(NAMES)
        figure = go.Figure(
            probability_figure(
                NAMES,
                np.arange(30) * 5.0 + 30.0,
                over_time,
                [classes[5], classes[0]],
                duration_s=180.0,
                onset_s=60.0,
            )
        )
        assert [line.name for line in figure.data] == [NAMES[classes[0]], NAMES[classes[5]]]
        assert {note.text for note in figure.layout.annotations} == {
            NAMES[classes[0]],
            NAMES[classes[5]],
        }
        assert figure.layout.shapes[0].label.text == "onset 1:00"


class TestTiles:
    def test_there_is_one_for_each_channel_with_its_unit_and_limits(self) -> None:
        specs = tile_specs()
        assert [spec["name"] for spec in specs] == [channel.name for channel in CHANNELS]
        assert all(spec["unit"] and spec["quiet"] > 0 and spec["still"] > 0 for spec in specs)
        assert specs[CHANNEL_INDEX["E1 CHT1"]]["limits"] == [500.0]

    def test_a_whole_flight_is_small_and_keeps_its_spike(self) -> None:
        pair = made_up_pair()
        flown = pair.faulted
        whole = decimated(flown.time_s, flown.channels, pair.mirror.channels)
        assert sum(len(text) for rows in whole for text in rows) < 700_000
        time_s, faulted, mirror = map(floats, whole[4])
        assert len(time_s) == len(faulted) == len(mirror)
        assert (faulted - mirror).max() == pytest.approx(500.0, abs=0.01)
        assert time_s[np.argmax(faulted - mirror)] == pytest.approx(140.0)


def test_the_page_can_be_laid_out():
    """Components refuse properties that they do not have only when they are made."""
    assert fly.layout().id == "fly"
