"""Workers that die as they come up, or never come: replaced, or said; no run waits in silence."""

import signal
import time
from collections.abc import Callable, Iterator

import dask.config
import psutil
import pytest
from distributed import Nanny
from elsewhere import Elsewhere, connected
from jobs_support import CRACK, PATIENCE_S, SHORT_PLAN, read_all

from core.errors import WorkerError
from core.jobs.answers import WORKER_DIED
from core.jobs.engine import CONNECTION_LOST, Engine
from core.jobs.events import Failed, Finished, Progress
from core.store.store import RunStore
from core.twin.plan import Plan
from core.workers.pool import LocalPool

pytestmark = [pytest.mark.slow, pytest.mark.alone]


@pytest.fixture(scope="module")
def lone(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Engine]:
    """An engine with one worker, killed in its very first moment."""
    engine = Engine(RunStore(tmp_path_factory.mktemp("lone")), n_workers=1, no_worker_s=PATIENCE_S)
    until(lambda: pid(engine)).send_signal(signal.SIGKILL)
    yield engine
    engine.close()


def until(found: Callable[[], int | None]) -> psutil.Process:
    """The process once there is one."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        if (number := found()) is not None:
            return psutil.Process(number)
        time.sleep(0.005)
    raise AssertionError(f"no worker after {PATIENCE_S:g} s")


def pool(engine: Engine) -> LocalPool:
    local = engine._cluster._local
    assert local is not None
    return local


def pid(engine: Engine) -> int | None:
    """The number of the one worker process, if it runs, whatever it has come to."""
    numbers = [nanny.pid for nanny in pool(engine)._created if nanny.pid is not None]
    return numbers[0] if numbers else None


def registered(engine: Engine) -> int | None:
    """Its number if the scheduler knows it, which is when it begins to warm up."""
    return pid(engine) if pool(engine).count() else None


def kill_next(engine: Engine, moment: Callable[[Engine], int | None]) -> None:
    """Kill the worker, and the next one as soon as it has come to that moment."""
    first = until(lambda: registered(engine))
    first.kill()

    def next_one() -> int | None:
        number = moment(engine)
        return number if number not in (None, first.pid) else None

    until(next_one).kill()


def test_a_pool_whose_first_worker_never_got_up_flies(lone: Engine) -> None:
    lone.wait_warm(PATIENCE_S)
    assert lone.wait(lone.submit(SHORT_PLAN, CRACK), timeout=PATIENCE_S).status == "done"


@pytest.mark.parametrize("moment", [pid, registered])
def test_a_worker_killed_as_it_comes_up_is_replaced(
    lone: Engine, moment: Callable[[Engine], int | None]
) -> None:
    # Dask closes nannies whose worker is not there so long after one died; ours stay.
    with dask.config.set({"distributed.deploy.lost-worker-timeout": "50 ms"}):
        kill_next(lone, moment)
        run_id = lone.submit(SHORT_PLAN, CRACK)
        kill_next(lone, moment)
        last = read_all(lone.subscribe(run_id))[-1]
    if isinstance(last, Failed):
        # On a busy machine the kills come late, and hit workers that fly the run already.
        assert last == Failed(run_id, WORKER_DIED, retryable=True)
        run_id = lone.submit(SHORT_PLAN, CRACK)
        last = read_all(lone.subscribe(run_id))[-1]
    assert last == Finished(run_id)


def test_a_worker_without_a_nanny_is_replaced(lone: Engine) -> None:
    until(lambda: registered(lone) if pool(lone).workers else None)
    (nanny,) = pool(lone).workers.values()
    pool(lone).sync(nanny.close)
    assert lone.wait(lone.submit(SHORT_PLAN, CRACK), timeout=PATIENCE_S).status == "done"


def test_a_run_that_a_closing_client_took_says_so_and_can_be_run_again(lone: Engine) -> None:
    # A client that gives up its scheduler cancels what it holds, but takes runs a moment longer.
    until(lambda: registered(lone))
    run_id = lone.submit(Plan(duration_s=900.0), CRACK)
    client = lone._cluster.client()
    client.futures.clear()
    client.close()
    assert read_all(lone.subscribe(run_id))[-1] == Failed(run_id, CONNECTION_LOST, retryable=True)
    assert lone.store.get(run_id).error == CONNECTION_LOST
    assert lone.wait(lone.submit(SHORT_PLAN, CRACK), timeout=PATIENCE_S).status == "done"


def test_a_client_that_closes_is_given_no_more_runs(
    lone: Engine, monkeypatch: pytest.MonkeyPatch
) -> None:
    closing = lone._cluster.client()
    monkeypatch.setattr(closing, "status", "closing")
    assert lone._cluster.client() is not closing
    monkeypatch.undo()
    closing.close()
    # One that is closed just as it is given a run.
    monkeypatch.setattr(lone._cluster, "client", lambda: closing)
    run_id = lone.submit(SHORT_PLAN, CRACK)
    assert lone.wait(run_id, timeout=PATIENCE_S).error == CONNECTION_LOST


def test_a_run_for_which_no_worker_starts_says_so_and_can_be_run_again(
    store: RunStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def refused(nanny: Nanny) -> None:
        raise OSError("Cannot allocate memory")

    monkeypatch.setattr(Nanny, "instantiate", refused)
    engine = Engine(store, n_workers=1, no_worker_s=1.0)
    try:
        run_id = engine.submit(SHORT_PLAN, CRACK)
        *said, last = read_all(engine.subscribe(run_id))
        assert said == [Progress(run_id, stage, 0.0) for stage in ("waiting", "no_worker")]
        assert isinstance(last, Failed) and last.retryable
        assert last.message.startswith("no worker could be had for 1 s")
        assert "memory" in last.message and "press Run again" in last.message
        assert (store.get(run_id).status, store.get(run_id).error) == ("failed", last.message)
        with pytest.raises(WorkerError, match="no worker could be had"):
            engine.fly_unseen(SHORT_PLAN, CRACK)
        monkeypatch.undo()
        until(lambda: registered(engine))
        engine.retry(run_id)
        assert engine.wait(run_id, timeout=PATIENCE_S).status == "done"
    finally:
        monkeypatch.undo()
        engine.close()


@pytest.fixture
def elsewhere(free_port: int) -> Iterator[Elsewhere]:
    room = Elsewhere(free_port)
    yield room
    room.stop()


def test_a_scheduler_without_workers_is_said_too(elsewhere: Elsewhere, store: RunStore) -> None:
    elsewhere.start_scheduler()
    engine = connected(store, elsewhere.address, no_worker_s=1.0)
    try:
        run_id = engine.submit(SHORT_PLAN, CRACK)
        last = read_all(engine.subscribe(run_id))[-1]
        assert isinstance(last, Failed) and last.retryable
        assert f"the Dask scheduler at {elsewhere.address} has none" in last.message
        elsewhere.start_worker()
        while not engine._cluster.client().nthreads():
            time.sleep(0.05)
        engine.retry(run_id)
        assert engine.wait(run_id, timeout=PATIENCE_S).status == "done"
    finally:
        engine.close()
