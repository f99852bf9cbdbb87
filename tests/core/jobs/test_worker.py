"""Flying a run in this process, as the command does."""

import pickle

import numpy as np
import pytest
from jobs_support import CRACK, SHORT_PLAN, samples_of

from core.clock import DT_S
from core.errors import InputError
from core.fmea.fault import Fault
from core.jobs.events import Diagnosed, Event, Probabilities, Progress, Reported
from core.jobs.worker import BLOCK_S, RunResult, fly_run
from core.twin.trajectory import Pair


@pytest.fixture(scope="module")
def flown() -> tuple[RunResult, list[Event]]:
    """The short run with all that it told."""
    events: list[Event] = []
    return fly_run("run", SHORT_PLAN, CRACK, events.append), events


def test_the_flight_is_whole(flown: tuple[RunResult, list[Event]], short_pair: Pair) -> None:
    result, _ = flown
    assert result.pair.faulted.channels.tobytes() == short_pair.faulted.channels.tobytes()
    assert result.pair.faulted.states.tobytes() == short_pair.faulted.states.tobytes()
    assert result.pair.mirror.channels.tobytes() == short_pair.mirror.channels.tobytes()


def test_samples_are_every_tenth(flown: tuple[RunResult, list[Event]], short_pair: Pair) -> None:
    samples = samples_of(flown[1])
    assert samples[0].time_s[0] == 0.0
    assert [part.index for part in samples] == [
        sum(len(before.time_s) for before in samples[:number]) for number in range(len(samples))
    ]
    for name, whole in {
        "time_s": short_pair.faulted.time_s,
        "faulted": short_pair.faulted.channels,
        "mirror": short_pair.mirror.channels,
        "faulted_states": short_pair.faulted.states,
        "mirror_states": short_pair.mirror.states,
    }.items():
        streamed = np.concatenate([getattr(part, name) for part in samples])
        assert streamed.dtype == np.float32
        np.testing.assert_array_equal(streamed, whole[::10].astype(np.float32), name)


def test_probabilities_are_those_of_the_diagnosis(flown: tuple[RunResult, list[Event]]) -> None:
    result, events = flown
    told = [event for event in events if isinstance(event, Probabilities)]
    assert [event.time_s for event in told] == list(result.diagnosis.time_s)
    assert [event.time_s for event in told] == pytest.approx([30.0, 35.0, 40.0])
    np.testing.assert_array_equal(
        np.stack([event.probabilities for event in told]), result.diagnosis.probabilities_over_time
    )


def test_progress_only_grows_and_the_end_is_told(flown: tuple[RunResult, list[Event]]) -> None:
    result, events = flown
    fractions = [event.fraction for event in events if isinstance(event, Progress)]
    assert fractions == sorted(fractions)
    assert 0.0 == fractions[0] < fractions[-1] < 1.0
    last = [event for event in events if isinstance(event, Diagnosed | Reported)]
    assert [type(event) for event in last] == [Diagnosed, Reported]
    assert isinstance(last[1], Reported)
    assert last[1].report == result.report


def test_messages_are_small(flown: tuple[RunResult, list[Event]]) -> None:
    _, events = flown
    sizes = [len(pickle.dumps(part, protocol=5)) for part in samples_of(events)]
    numbers = sum(
        2 * (part.faulted.size + part.faulted_states.size) + part.extremes.size
        for part in samples_of(events)
    )
    assert sum(sizes) < 4 * numbers * 1.2


def test_a_raising_listener_stops_the_flight_within_a_block() -> None:
    class StopError(Exception):
        pass

    seen: list[Event] = []

    def emit(event: Event) -> None:
        seen.append(event)
        if len(samples_of(seen)) == 2:
            raise StopError

    with pytest.raises(StopError):
        fly_run("run", SHORT_PLAN, CRACK, emit)
    assert len(samples_of(seen)[-1].time_s) * 10 * DT_S == pytest.approx(BLOCK_S)


def test_an_onset_beyond_the_end_is_refused() -> None:
    with pytest.raises(InputError, match="onset_s"):
        fly_run("run", SHORT_PLAN, Fault("baffle_crack", onset_s=40.0), lambda event: None)
