"""serve as a process: what it listens on, and that nothing of it is left behind."""

import time

import psutil
import pytest

pytestmark = pytest.mark.slow


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
    assert psutil.wait_procs(family, timeout=5)[1] == []
    # The workers were still loading what they need.
    assert "Traceback" not in server.log.read_text()


def test_told_to_stop_with_all_its_workers_it_says_nothing_and_leaves_nothing(start_server):
    server = start_server()
    family = [psutil.Process(server.process.pid)]
    family += family[0].children(recursive=True)
    time.sleep(1.0)
    for process in family:
        process.terminate()
    assert psutil.wait_procs(family, timeout=10)[1] == []
    assert server.log.read_text().count("\n") == 1, server.log.read_text()


def test_the_store_is_where_it_was_asked_for(start_server, tmp_path):
    server = start_server(store=tmp_path / "flights")
    assert (tmp_path / "flights" / "index.sqlite").is_file()
    assert f"http://127.0.0.1:{server.port}" in server.log.read_text()
