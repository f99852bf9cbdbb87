"""serve as a process: what it listens on, and that nothing of it is left behind."""

import time
from contextlib import suppress

import psutil
import pytest

pytestmark = [pytest.mark.slow, pytest.mark.alone]


def left(family, timeout_s):
    """Who still runs after that time; not who has ended and only waits for init to notice."""
    running = []
    for process in psutil.wait_procs(family, timeout_s)[1]:
        with suppress(psutil.NoSuchProcess):
            if process.status() != psutil.STATUS_ZOMBIE:
                running.append(process)
    return running


def test_everything_listens_on_loopback_and_ends_with_the_server(start_server):
    server = start_server()
    family = [psutil.Process(server.process.pid)]
    family += family[0].children(recursive=True)
    listening = [
        connection.laddr
        for process in family
        for connection in process.net_connections("inet")
        if connection.status == psutil.CONN_LISTEN
    ]
    assert server.port in {address.port for address in listening}
    assert {address.ip for address in listening} <= {"127.0.0.1", "::1"}
    assert len(family) > 1, "the flights are flown by processes of their own"

    server.stop()
    assert left(family, 5.0) == []
    # The workers were still loading what they need.
    assert "Traceback" not in server.log.read_text()


def test_told_to_stop_with_all_its_workers_it_says_nothing_and_leaves_nothing(start_server):
    server = start_server()
    family = [psutil.Process(server.process.pid)]
    family += family[0].children(recursive=True)
    time.sleep(1.0)
    for process in family:
        process.terminate()
    assert left(family, 10.0) == []
    assert server.log.read_text().count("\n") == 1, server.log.read_text()


def test_the_store_is_where_it_was_asked_for(start_server, tmp_path):
    server = start_server(store=tmp_path / "flights")
    assert (tmp_path / "flights" / "index.sqlite").is_file()
    assert f"http://127.0.0.1:{server.port}" in server.log.read_text()
