"""Many pages on one server, as a user starts it: nobody is slowed, nobody sees another's flight.

`mirrortwin bench --clients 50` measures the same at full size; here it has to hold on any machine.
"""

import asyncio
import socket
import threading
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import httpx
import psutil
import pytest
import uvicorn

from app.crowd.measure import Flights, crowd, one_after_another
from app.crowd.page import CrowdPage
from app.crowd.server import Served, served
from app.pages.fly import session as live
from app.server import create_app, give_up_unread
from core.fmea.fault import Fault
from core.jobs.engine import Engine
from core.store.store import RunStore
from core.twin.plan import Plan

pytestmark = [pytest.mark.slow, pytest.mark.alone]

PAGES = 8


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Served]:
    with served(tmp_path_factory.mktemp("crowd")) as running:
        yield running


def test_each_page_of_a_crowd_gets_its_own_flight_and_no_other(server: Served) -> None:
    met = asyncio.run(crowd(server, PAGES, Flights(60.0, None)))
    assert met.strangers == 0 and met.foreign_flights == 0
    assert met.delays.samples == PAGES * 300
    assert met.mb_a_page < 2.0


def test_five_minutes_of_flight_are_under_two_megabytes_for_the_page_and_13_for_rerun(
    server: Served,
) -> None:
    async def fly() -> tuple[str, int]:
        async with CrowdPage(server.url) as page:
            run_id = await page.fly(Plan(seed=5), Fault("engine_run_rough", 0.8, 60.0))
            assert await page.until_ended(120.0) == "done"
            return run_id, page.n_bytes

    run_id, n_bytes = asyncio.run(fly())
    assert n_bytes < 2_000_000
    stored = server.store / "runs" / run_id / "run.rrd"
    assert 500_000 < len(httpx.get(f"{server.url}/recordings/{run_id}.rrd").content) < 13_000_000
    assert stored.stat().st_size < 13_000_000


def test_run_after_run_leaves_nothing_in_memory(server: Served) -> None:
    """Every run once left eight threads and ten megabytes."""
    threads = server.process.num_threads()
    after_ten_mb, after_twenty_mb = asyncio.run(one_after_another(server, 20))
    assert after_twenty_mb - after_ten_mb < 30.0
    assert server.process.num_threads() < threads + 20


@asynccontextmanager
async def hasty(store: RunStore) -> AsyncIterator[str]:
    """A server with little patience, on a thread of its own; yields its address."""
    engine = Engine(store, n_workers=1)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        give_up_unread(listener)
        # As over a slow network: what is not taken stays here, not in the system's buffers.
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 16_384)
        app = create_app(engine, store)
        # Without pings, which would end the connection before it is stuck.
        config = uvicorn.Config(app, log_level="error", ws_ping_interval=None)
        running = uvicorn.Server(config)
        thread = threading.Thread(target=running.run, kwargs={"sockets": [listener]})
        thread.start()
        while not running.started:
            await asyncio.sleep(0.01)
        try:
            yield f"http://127.0.0.1:{listener.getsockname()[1]}"
        finally:
            running.should_exit = True
            await asyncio.to_thread(thread.join)
            engine.close()


def test_a_page_that_never_reads_slows_nobody_and_is_let_go(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(live, "ACK_TIMEOUT_S", 2.0)
    monkeypatch.setattr(live, "LINGER_S", 0.5)
    monkeypatch.setattr("app.server.UNREAD_S", 2.0)

    async def scenario() -> None:
        async with hasty(RunStore(tmp_path)) as url, CrowdPage(url) as deaf, CrowdPage(url) as page:
            port = int(url.rsplit(":", 1)[1])
            await deaf.fly(Plan(seed=1), Fault("engine_failure", 0.8, 60.0))
            deaf.stop_reading()
            # Far more than the system's buffers hold, so that its connection is stuck for good.
            for _ in range(40):
                deaf.props["url", "pathname"] = "/faults"
                await deaf.start(("url", "pathname"))
            await page.fly(Plan(seed=2), Fault("baffle_crack", 0.8, 60.0))
            assert await page.until_ended(120.0) == "done"
            async with asyncio.timeout(30.0):
                while connections(port) > 1:
                    await asyncio.sleep(0.1)
            assert await page.is_served()

    asyncio.run(scenario())


def connections(port: int) -> int:
    """How many connections the server on that port still holds, of those to pages."""
    return sum(
        each.laddr.port == port and each.status in (psutil.CONN_ESTABLISHED, psutil.CONN_CLOSE_WAIT)
        for each in psutil.Process().net_connections("tcp4")
    )
