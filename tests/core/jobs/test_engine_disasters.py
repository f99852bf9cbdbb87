"""Killed workers, killed servers, lost schedulers, full disks: told, survived, nothing lost."""

import http.server
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest
from elsewhere import Elsewhere, connected
from jobs_support import CRACK, PATIENCE_S, SHORT_PLAN, read_all, read_until, samples_of

from core.errors import StoreError, WorkerError
from core.fmea.fault import Fault
from core.jobs.engine import CONNECTION_LOST, WORKER_DIED, Engine
from core.jobs.events import Failed, Finished, Progress, Samples, Started
from core.store.store import SERVER_STOPPED, RunStore
from core.twin.flight import fly_pair
from core.twin.plan import Plan
from core.twin.trajectory import Pair
from core.workers.scheduler import RemoteScheduler

pytestmark = pytest.mark.alone

PLAN = Plan(duration_s=1200.0, seed=3)


@pytest.fixture(scope="module")
def doomed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Engine]:
    """An engine whose workers get killed."""
    engine = Engine(RunStore(tmp_path_factory.mktemp("doomed")), n_workers=2)
    engine.wait_warm(timeout=PATIENCE_S)
    yield engine
    engine.close()


def kill_flying_worker(engine: Engine) -> int:
    """SIGKILL the one worker process that has a run; returns its pid."""
    client = engine._cluster.client()
    (address,) = (worker for worker, keys in client.processing().items() if keys)
    (pid,) = client.run(os.getpid, workers=[address]).values()
    os.kill(pid, signal.SIGKILL)
    return int(pid)


@pytest.mark.slow
def test_a_killed_worker_costs_a_run_nothing_but_time(doomed: Engine) -> None:
    run_id = doomed.submit(PLAN, CRACK)
    subscription = doomed.subscribe(run_id)
    read_until(subscription, Samples)
    kill_flying_worker(doomed)
    assert read_until(subscription, Started) == Started(run_id, 2)
    second_try = read_all(subscription)
    assert second_try[-1] == Finished(run_id)
    samples = samples_of(second_try)
    assert samples[0].index == 0
    assert sum(len(part.time_s) for part in samples) == 6000
    assert doomed.history(run_id) == [Started(run_id, 2), *second_try]
    assert doomed.store.get(run_id).attempts == 2
    stored = doomed.store.load_pair(run_id)
    undisturbed = fly_pair(PLAN, CRACK)
    assert stored.faulted.channels.tobytes() == undisturbed.faulted.channels.tobytes()


@pytest.mark.slow
def test_a_run_that_loses_two_workers_fails_and_can_be_run_again(doomed: Engine) -> None:
    run_id = doomed.submit(PLAN, CRACK)
    subscription = doomed.subscribe(run_id)
    for attempt in (1, 2):
        assert read_until(subscription, Started) == Started(run_id, attempt)
        read_until(subscription, Samples)
        kill_flying_worker(doomed)
    assert read_all(subscription)[-1] == Failed(run_id, WORKER_DIED, retryable=True)
    record = doomed.store.get(run_id)
    assert (record.status, record.error, record.attempts) == ("failed", WORKER_DIED, 2)
    doomed.retry(run_id)
    assert doomed.wait(run_id, timeout=PATIENCE_S).status == "done"
    assert (doomed.store.get(run_id).error, doomed.store.get(run_id).attempts) == (None, 1)


@pytest.mark.slow
def test_a_killed_servers_run_is_marked_when_the_next_one_starts(tmp_path: Path) -> None:
    program = (
        "import sys; from pathlib import Path; from core.jobs.engine import Engine;"
        "from core.store.store import RunStore; from core.jobs.events import Samples;"
        "from core.fmea.fault import Fault; from core.twin.plan import Plan\n"
        "if __name__ == '__main__':\n"
        "    engine = Engine(RunStore(Path(sys.argv[1])), n_workers=1)\n"
        "    run_id = engine.submit(Plan(duration_s=7200.0), Fault('baffle_crack'))\n"
        "    reader = engine.subscribe(run_id)\n"
        "    while not isinstance(reader.get(), Samples): pass\n"
        "    print(run_id, flush=True)\n"
        "    engine.wait(run_id)\n"
    )
    script = tmp_path / "server.py"
    script.write_text(program)
    command = [sys.executable, str(script), str(tmp_path / "store")]
    environment = {**os.environ, "PYTHONPATH": str(Path.cwd())}
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True, env=environment
    ) as server:
        assert server.stdout is not None
        run_id = server.stdout.readline().strip()
        workers = psutil.Process(server.pid).children(recursive=True)
        server.send_signal(signal.SIGKILL)
    store = RunStore(tmp_path / "store")
    assert store.get(run_id).status == "running"
    engine = Engine(store, n_workers=1)
    try:
        assert (store.get(run_id).status, store.get(run_id).error) == ("failed", SERVER_STOPPED)
        assert engine.history(run_id) == [Failed(run_id, SERVER_STOPPED, retryable=True)]
    finally:
        engine.close()
    _, alive = psutil.wait_procs(workers, timeout=PATIENCE_S)
    assert alive == []  # the orphaned workers have gone by themselves


@pytest.mark.slow
def test_a_full_disk_fails_the_run_and_harms_no_other(
    disk: Callable[[str], Path], short_pair: Pair
) -> None:
    store = RunStore(disk("size=3m") / "store")
    engine = Engine(store, n_workers=1)
    try:
        stored = engine.submit(SHORT_PLAN, CRACK)
        assert engine.wait(stored, timeout=PATIENCE_S).status == "done"
        too_long = engine.submit(PLAN, CRACK)
        final = read_all(engine.subscribe(too_long))[-1]
        assert isinstance(final, Failed)
        assert final.retryable
        assert "No space left" in final.message
        assert str(store.root) in final.message
        assert store.load_pair(stored).residual.tobytes() == short_pair.residual.tobytes()
        disk("size=100m")
        engine.retry(too_long)
        assert engine.wait(too_long, timeout=PATIENCE_S).status == "done"
    finally:
        engine.close()
        store.close()


def test_a_read_only_store_refuses_runs_but_not_the_server(disk: Callable[[str], Path]) -> None:
    disk("size=1m")
    store = RunStore(disk("ro") / "store")
    engine = Engine(store, n_workers=1)
    try:
        with pytest.raises(StoreError, match=r"(?i)read-only") as caught:
            engine.submit(SHORT_PLAN, CRACK)
        assert str(store.root) in str(caught.value)
    finally:
        engine.close()


# -- a scheduler elsewhere -----------------------------------------------------------------------


@pytest.fixture
def elsewhere(free_port: int) -> Iterator[Elsewhere]:
    """Room for a scheduler on a free port."""
    room = Elsewhere(free_port)
    yield room
    room.stop()


@pytest.mark.slow
def test_a_remote_scheduler_flies_the_same_and_may_come_back(
    elsewhere: Elsewhere, store: RunStore, short_pair: Pair
) -> None:
    scheduler = elsewhere.start_scheduler()
    elsewhere.start_worker()
    engine = connected(store, elsewhere.address)
    try:
        run_id = engine.submit(SHORT_PLAN, CRACK)
        assert read_all(engine.subscribe(run_id))[-1] == Finished(run_id)
        stored = store.load_pair(run_id)
        assert stored.faulted.channels.tobytes() == short_pair.faulted.channels.tobytes()

        lost = engine.submit(Plan(duration_s=7200.0), CRACK)
        subscription = engine.subscribe(lost)
        read_until(subscription, Samples)
        scheduler.kill()
        scheduler.wait()
        assert read_all(subscription)[-1] == Failed(lost, CONNECTION_LOST, retryable=True)

        elsewhere.start_scheduler()
        elsewhere.start_worker()
        deadline, ended = time.monotonic() + PATIENCE_S, ""
        while ended != "done":
            assert time.monotonic() < deadline, f"the last run {ended or 'was refused'}"
            try:
                again = engine.submit(SHORT_PLAN, CRACK)
            except WorkerError:
                continue
            ended = engine.wait(again, timeout=PATIENCE_S).status
        assert [type(event) for event in engine.history(again)[:2]] == [Progress, Started]
    finally:
        engine.close()


@pytest.mark.slow
def test_a_remote_run_is_begun_twice_at_most(elsewhere: Elsewhere, store: RunStore) -> None:
    elsewhere.start_scheduler()
    elsewhere.start_worker()
    engine = connected(store, elsewhere.address)
    try:
        run_id = engine.submit(PLAN, CRACK)
        subscription = engine.subscribe(run_id)
        for attempt in (1, 2):
            assert read_until(subscription, Started) == Started(run_id, attempt)
            read_until(subscription, Samples)
            kill_flying_worker(engine)
        final = engine.wait(run_id, timeout=PATIENCE_S)
        assert (final.status, final.error, final.attempts) == ("failed", WORKER_DIED, 2)
        assert engine.wait(engine.submit(SHORT_PLAN, Fault()), timeout=PATIENCE_S).status == "done"
    finally:
        engine.close()


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:{port}", "nonsense://127.0.0.1:{port}"])
def test_an_unreachable_scheduler_is_named(store: RunStore, free_port: int, address: str) -> None:
    with pytest.raises(WorkerError, match="dask scheduler") as caught:
        Engine(store, RemoteScheduler(address.format(port=free_port)))
    assert address.format(port=free_port) in str(caught.value)


def test_something_else_at_the_address_is_no_scheduler(store: RunStore) -> None:
    handler = http.server.SimpleHTTPRequestHandler
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as stranger:
        threading.Thread(target=stranger.serve_forever, daemon=True).start()
        with pytest.raises(WorkerError, match="no Dask scheduler answers"):
            Engine(store, RemoteScheduler(f"127.0.0.1:{stranger.server_port}"))
        stranger.shutdown()
