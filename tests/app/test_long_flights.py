"""Flights of two hours on the page: light, and no spike of a single sample is lost."""

from base64 import b64decode
from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scripts import PageFlight

from app.figures.streamed import GROUPS, LIVE_POINTS
from app.pages.fly.files import part_of, streamed_part
from app.pages.fly.view import RunView
from core.channels import CHANNEL_INDEX, N_CHANNELS
from core.clock import DT_S
from core.errors import InputError, StoreError
from core.fmea.fault import Fault
from core.jobs.extremes import SECOND, Seconds, extremes
from core.jobs.worker import _samples
from core.store.records import RunRecord, new_run_id
from core.store.store import RunStore
from core.twin.plan import Plan
from core.twin.trajectory import STATE_NAMES, Pair, Trajectory

TWO_HOURS = Plan(duration_s=7200.0)
SPIKE_ROW, SPIKE = 123_457, 400.0
DIP_ROW, DIP = 123_490, -300.0
"""In the same stretch as the spike, however long flights are thinned."""

CHT1 = CHANNEL_INDEX["E1 CHT1"]


@pytest.fixture(scope="module")
def two_hours() -> Pair:
    """Noise, a spike of one sample in the faulted flight, and a dip of one in the mirror's."""
    n = 360_000
    rng = np.random.default_rng(8)
    time_s = np.arange(n) * DT_S
    states = np.zeros((n, len(STATE_NAMES)))
    noise = rng.normal(0.0, 1.0, (2, 5000, N_CHANNELS)).astype(np.float32)
    faulted, mirror = (np.tile(part, (n // 5000, 1)) for part in noise)
    faulted[SPIKE_ROW, CHT1] = SPIKE
    mirror[DIP_ROW, CHT1] = DIP
    return Pair(Trajectory(time_s, states, faulted), Trajectory(time_s, states, mirror))


def floats(text: str) -> NDArray[np.float32]:
    return np.frombuffer(b64decode(text), dtype=np.float32)


def blocks(pair: Pair, seconds: float) -> Iterator[Pair]:
    """A pair as it is flown, block by block."""
    rows = round(seconds / DT_S)
    for start in range(0, len(pair.faulted), rows):
        yield pair[start : start + rows]


def view_of(plan: Plan) -> RunView:
    return RunView(RunRecord(new_run_id(), "2026-11-23T06:15:00+00:00", "queued", plan, Fault()))


def size(message: dict[str, Any]) -> int:
    """The characters of a message's samples."""
    own = sum(len(message[side]) for side in ("time_s", "faulted", "mirror"))
    return own + sum(map(len, message["extremes"]))


def lines(rows: list[list[float]]) -> NDArray[np.float64]:
    """Time, faulted and mirror (3, n) as the page has them."""
    return np.array(rows, dtype=np.float64)


def stream(pair: Pair, plan: Plan, block_s: float, a_batch: int, page: PageFlight) -> int:
    """Send a flight to a page, so many blocks a batch; returns how much was sent."""
    view, seconds, n_sent = view_of(plan), Seconds(), 0
    batch = []
    for block in blocks(pair, block_s):
        batch.append(_samples("r", block, seconds.push(block)))
        if len(batch) == a_batch:
            sent = [item.value for item in view.changes(batch) if item.component_id == "flight"]
            view.taken = page.take(sent[-1])
            n_sent += size(sent[-1])
            batch = []
    return n_sent


@settings(max_examples=40)
@given(st.integers(2, 60), st.integers(0, 2**32 - 1))
def test_the_extremes_of_each_bucket_are_kept(width: int, seed: int) -> None:
    samples = np.random.default_rng(seed).integers(-9, 9, (3, 4, 5, width)).astype(np.float32)
    samples[0] = np.arange(width)
    kept = extremes(samples)
    assert kept.shape == (3, 4, 5, 6)
    assert np.all(np.diff(kept[0]) >= 0.0)
    for line in (1, 2):
        np.testing.assert_array_equal(kept[line].min(-1), samples[line].min(-1))
        np.testing.assert_array_equal(kept[line].max(-1), samples[line].max(-1))
    np.testing.assert_array_equal((kept[1] - kept[2]).max(-1), (samples[1] - samples[2]).max(-1))
    np.testing.assert_array_equal((kept[1] - kept[2]).min(-1), (samples[1] - samples[2]).min(-1))
    flown = {tuple(sample) for sample in samples[:, 0, 0].T}
    assert {tuple(sample) for sample in kept[:, 0, 0].T} <= flown


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(1, 12), min_size=1, max_size=40))
def test_seconds_do_not_depend_on_how_a_flight_is_cut(tenths: list[int]) -> None:
    n = 10 * sum(tenths)
    rng = np.random.default_rng(n)
    channels = rng.normal(0.0, 1.0, (2, n, N_CHANNELS)).astype(np.float32)
    states = np.zeros((n, len(STATE_NAMES)))
    pair = Pair(*(Trajectory(np.arange(n) * DT_S, states, side) for side in channels))
    seconds, came, row = Seconds(), [], 0
    for length in tenths:
        came.append(seconds.push(pair[row : row + 10 * length]))
        row += 10 * length
    kept = np.concatenate(came, axis=2)
    assert kept.shape == (3, N_CHANNELS, n // SECOND, 6)
    for second in range(n // SECOND):
        rows = channels[0, SECOND * second : SECOND * (second + 1)]
        np.testing.assert_array_equal(kept[1, :, second].max(-1), rows.max(0))
        np.testing.assert_array_equal(kept[1, :, second].min(-1), rows.min(0))


def assert_spikes(time_s: Any, faulted: Any, mirror: Any) -> None:
    """The two planted samples are there, where they were and as high."""
    assert faulted.max() == SPIKE
    assert mirror.min() == DIP
    assert time_s[faulted.argmax()] == pytest.approx(SPIKE_ROW * DT_S, abs=0.001)
    assert time_s[mirror.argmin()] == pytest.approx(DIP_ROW * DT_S, abs=0.001)


def test_a_spike_is_there_while_two_hours_stream(two_hours: Pair) -> None:
    with PageFlight() as page:
        n_sent = stream(two_hours, TWO_HOURS, 5.0, 40, page)
        drawn, extremes = lines(page.rows(CHT1)), lines(page.extremes(CHT1))
    assert_spikes(*drawn)
    assert_spikes(*extremes)
    assert np.all(np.diff(drawn[0]) > 0.0)
    assert extremes.shape[1] <= 6 * GROUPS
    assert drawn.shape[1] <= 1.01 * LIVE_POINTS + extremes.shape[1]
    assert n_sent < 1e6, "the page has 2 MB for a flight, and its whole view is to come"


def test_a_spike_is_there_as_soon_as_its_second_is_over(two_hours: Pair) -> None:
    late = two_hours[SPIKE_ROW - 2_357 : SPIKE_ROW + 43]
    with PageFlight() as page:
        stream(Pair(late.faulted, late.mirror), TWO_HOURS, 0.2, 1, page)
        assert lines(page.rows(CHT1))[1].max() == SPIKE


def test_what_a_page_missed_is_sent_again(two_hours: Pair) -> None:
    view, seconds = view_of(TWO_HOURS), Seconds()
    with PageFlight() as page:
        for number, block in enumerate(blocks(two_hours[:60_000], 5.0)):
            sent = [
                item.value
                for item in view.changes([_samples("r", block, seconds.push(block))])
                if item.component_id == "flight"
            ]
            if number % 9 == 0:
                view.taken = page.take(sent[-1])
        page.take(sent[-1])
        extremes = lines(page.extremes(CHT1))
    first = two_hours.faulted.channels[: 36 * SECOND, CHT1]
    assert extremes[1, :6].max() == first.max()
    assert np.all(np.diff(extremes[0]) >= 0.0)
    assert extremes[0, -1] > 1190.0


def test_a_spike_is_there_in_the_whole_view(two_hours: Pair) -> None:
    flown, mirror = two_hours.faulted, two_hours.mirror
    (update,) = view_of(TWO_HOURS).tiles(flown.time_s, flown.channels, mirror.channels)
    assert_spikes(*map(floats, update.value["whole"][CHT1]))
    assert weight(update.value["whole"]) < 700_000


def weight(whole: list[list[str]]) -> int:
    return sum(len(text) for rows in whole for text in rows)


def test_a_stored_flight_is_as_fine_as_it_was_flown_where_it_is_zoomed_into(
    two_hours: Pair, tmp_path: Any
) -> None:
    store = RunStore(tmp_path)
    run_id = store.create(TWO_HOURS, Fault()).id
    store.save_pair(run_id, two_hours)
    store.update(run_id, status="done")
    engine: Any = SimpleNamespace()
    at_s = SPIKE_ROW * DT_S
    for width_s in (7.0, 60.0, 700.0, 5000.0):
        part = part_of(engine, store, run_id, at_s - width_s / 3, at_s + width_s / 3)
        time_s, faulted, mirror = map(floats, part["whole"][CHT1])
        assert_spikes(time_s, faulted, mirror)
        assert weight(part["whole"]) < 700_000
        inside = np.abs(two_hours.faulted.time_s - at_s) < width_s / 3
        assert part["is_exact"] == (inside.sum() <= 400)
        if part["is_exact"]:
            np.testing.assert_array_equal(faulted, two_hours.faulted.channels[inside, CHT1])
        assert part["until_s"] == pytest.approx(at_s + width_s / 3, abs=DT_S)
    for from_s, to_s in ((5.0, 5.0), (-1.0, 3.0), (0.0, 1e9), (float("nan"), 3.0)):
        with pytest.raises(InputError, match="from_s"):
            part_of(engine, store, run_id, from_s, to_s)
    with pytest.raises(StoreError):
        part_of(engine, store, "20261123T061500-k3x9q2wz", 0.0, 1.0)
    store.close()


def test_a_flight_in_the_air_has_its_spikes_where_it_is_zoomed_into(two_hours: Pair) -> None:
    seconds = Seconds()
    flown = [_samples("r", block, seconds.push(block)) for block in blocks(two_hours[:130_000], 5)]
    part = streamed_part(flown, 2400.0, 2500.0)
    assert_spikes(*map(floats, part["whole"][CHT1]))
    assert part["until_s"] == pytest.approx(2500.0, abs=5.1)
    time_s, *_ = map(floats, part["whole"][0])
    assert (time_s.min(), time_s.max()) == pytest.approx((2400.0, 2500.0), abs=0.5)
    assert np.all(np.diff(time_s) > 0.0)
    assert len(time_s) > 390, "finer than what the page has of the whole flight"
    part = streamed_part(flown, 3000.0, 3100.0)
    assert (weight(part["whole"]), part["until_s"]) == (0, 3000.0), "not flown yet"
