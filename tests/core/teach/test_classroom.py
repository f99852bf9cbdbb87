"""The keeper of mystery flights: what it tells, and when."""

import json
import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from core.errors import InputError, StoreError, WorkerError
from core.exchange.report_file import stored_report
from core.fmea.fault import Fault
from core.jobs.worker import RunResult, fly_run
from core.store.store import RunStore
from core.teach.challenge import Challenge
from core.teach.classroom import Classroom, has_attempt
from core.teach.scoring import Mark
from core.twin.plan import Plan


def fly(plan: Plan, fault: Fault) -> RunResult:
    return fly_run("unseen", plan, fault, lambda event: None)


@pytest.fixture
def store(tmp_path: Path) -> Iterator[RunStore]:
    store = RunStore(tmp_path)
    yield store
    store.close()


def test_nothing_is_told_before_the_end_and_everything_after(store: RunStore) -> None:
    room = Classroom(store, fly)
    challenge = Challenge(modes=("cylinder_compression",), code="one")
    begun = room.start(challenge, "ann")
    assert has_attempt(store, begun.id) and not has_attempt(store, "../" + begun.id)
    assert store.records() == []
    with pytest.raises(InputError, match="still open"):
        room.truth(begun.id)
    assert room.mirror(begun.id) is None
    with pytest.raises(StoreError, match="no run"):
        stored_report(store, begun.id)
    told = json.dumps(begun.to_dict() | {"challenge": None})
    assert "compression" not in told and "onset" not in told

    room.mark(begun.id, Mark("E1 EGT4", 10.0, "+"))
    room.mark(begun.id, Mark("volt1", 10.0, "+"))
    room.unmark(begun.id, "volt1")
    room.mark(begun.id, Mark("E1 EGT4", 140.0, "-"))
    room.show_mirror(begun.id)
    assert room.mirror(begun.id) is not None
    # Another process, or this one after a restart.
    again = Classroom(store, fly)
    assert again.get(begun.id).marks == (Mark("E1 EGT4", 140.0, "-"),)
    # The same learner does not get the same flight twice; another one does.
    assert again.start(challenge, "ann").id == begun.id
    other = again.start(challenge, "bob")
    assert other.id != begun.id
    np.testing.assert_array_equal(
        again.readings(other.id).channels, again.readings(begun.id).channels
    )

    over = again.submit(begun.id, "cylinder_crack")
    assert over.over and over.score is not None and over.score.nearness == "look-alike"
    assert over.run_id is not None
    truth = again.truth(begun.id)
    assert truth.fault.mode == "cylinder_compression"
    record = store.get(over.run_id)
    assert (record.status, record.fault, record.plan) == ("done", truth.fault, truth.plan)
    outcome = stored_report(store, over.run_id).outcome
    assert outcome is not None
    assert outcome.line.startswith("Injected: Cylinder compression. Diagnosed: ")
    np.testing.assert_array_equal(
        store.load_pair(over.run_id).faulted.channels, again.readings(begun.id).channels
    )
    for act in (
        lambda: again.submit(begun.id, "cylinder_compression"),
        lambda: again.mark(begun.id, Mark("volt1", 10.0, "+")),
        lambda: again.show_mirror(begun.id),
    ):
        with pytest.raises(InputError, match="is over"):
            act()
    assert again.get(begun.id) == over
    assert again.attempts("ann") == [over]


def test_a_flight_that_fails_does_not_say_what_it_was(store: RunStore) -> None:
    def fail(plan: Plan, fault: Fault) -> RunResult:
        raise WorkerError(f"could not fly {fault.mode}")

    room = Classroom(store, fail)
    with pytest.raises(WorkerError) as caught:
        room.start(Challenge(modes=("baffle_crack",)), "ann")
    assert "baffle" not in str(caught.value) and caught.value.__cause__ is None
    assert room.attempts("ann") == []


def test_names_that_name_nothing_are_refused(store: RunStore) -> None:
    room = Classroom(store, fly)
    for name in ("", "..", "../index.sqlite", "20261123T061500-k3x9q2wz"):
        with pytest.raises(StoreError, match="no mystery flight"):
            room.get(name)


def test_a_damaged_attempt_hides_no_other(store: RunStore) -> None:
    room = Classroom(store, fly)
    first, second = (room.start(Challenge(modes=("nominal",)), "ann").id for _ in range(2))
    (store.root / "teach" / second / "attempt.json").write_text("[" * 100_000)
    assert [attempt.id for attempt in room.attempts("ann")] == [first]


def test_a_store_that_was_removed_does_not_come_back_with_a_mystery_alone(store: RunStore) -> None:
    shutil.rmtree(store.root)
    with pytest.raises(StoreError, match="was removed or replaced"):
        Classroom(store, fly).start(Challenge(modes=("nominal",)), "ann")
    assert not store.root.exists()
