"""What the server answers to whom, over HTTP."""

import re
import socket
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from starlette.routing import Route
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.gate.security import MAX_BODY_BYTES
from app.server import create_app, serve
from core.errors import InputError, WorkerError
from core.fmea.fault import Fault
from core.jobs.engine import Engine
from core.paths import DATA, WEB
from core.store.store import RunStore
from core.twin.plan import Plan


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> RunStore:
    return RunStore(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def app(store: RunStore) -> Iterator[FastAPI]:
    engine = Engine(store, n_workers=1)
    yield create_app(engine, store)
    engine.close()


@pytest.fixture(scope="module")
def client(app: FastAPI, serve_app: Any) -> Iterator[httpx.Client]:
    """A client of the app, served by uvicorn on a free port."""
    with serve_app(lambda port: app) as url, httpx.Client(base_url=url) as client:
        yield client


def test_pages_that_exist(client: httpx.Client, store: RunStore) -> None:
    run_id = store.create(Plan(), Fault()).id
    # Not "/" first: the first request of all may come by a shared link.
    others = ("/faults", "/faults/baffle_seal", "/fly/nominal", "/results", "/results/table1")
    others += ("/compare", f"/compare/{run_id}", "/compare/fig7")
    for path in ("/runs", f"/run/{run_id}", "/", *others):
        answer = client.get(path)
        assert answer.status_code == 200, path
        assert "/assets/style.css" in answer.text, path
        assert "<title>MirrorTwin</title>" in answer.text


@pytest.mark.parametrize(
    "path",
    [
        "/run/nonsense",
        "/run/20261123T061500-k3x9q2wz",
        "/run/../../etc/passwd",
        "/run/<script>alert(1)</script>",
        "/nowhere",
        "/faults/nonsense",
        "/faults/<script>alert(1)</script>",
        "/fly/nonsense",
        "/fly/",
        "/results/nonsense",
        "/compare/nonsense",
        "/compare/20261123T061500-k3x9q2wz",
        "/results/files/nonsense.png",
        "/results/files/../../pyproject.toml",
        "/results/files/%2e%2e%2f%2e%2e%2fpyproject.toml",
        "/docs",
        "/redoc",
        "/openapi.json",
        "/assets/../pyproject.toml",
        "/viser/someone-elses-session/",
        "/recordings/20261123T061500-k3x9q2wz.rrd",
        "/_mcp",
    ],
)
def test_paths_that_do_not_exist(client: httpx.Client, path: str) -> None:
    answer = client.get(path)
    assert answer.status_code == 404
    assert "Traceback" not in answer.text
    assert "alert(1)" not in answer.text


def data_addresses(file: Path) -> Iterator[str]:
    """Every address at which a file of data might be served by mistake."""
    name = file.relative_to(DATA).as_posix()
    for up in (
        "",
        "data/",
        "../data/",
        "../assets/data/",
        "%2e%2e/data/",
        "..%2fdata%2f",
        "..//data/",
    ):
        yield f"/assets/{up}{name}"
    yield f"/assets/{file.name}"
    yield f"/assets/{file}"
    yield f"/data/{name}"


def test_the_data_of_the_program_are_not_served(client: httpx.Client) -> None:
    files = [file for file in DATA.rglob("*") if file.is_file()]
    assert len(files) > 10
    assert client.get("/assets/style.css").content == (WEB / "style.css").read_bytes()
    for file in files:
        content = file.read_bytes()
        for address in data_addresses(file):
            answer = client.get(address)
            assert answer.status_code == 404, address
            assert answer.content != content, address


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8050", "127.0.0.1.evil.example"])
def test_foreign_hosts_are_refused(client: httpx.Client, host: str) -> None:
    assert client.get("/", headers={"Host": host}).status_code == 400


FOREIGN = ["http://evil.example", "http://127.0.0.1:1", "ftp://127.0.0.1:{port}", "null", "", "]["]


@pytest.mark.parametrize("path", ["/_dash-ws-callback", "/viser/x", "/nowhere"])
@pytest.mark.parametrize("origin", [*FOREIGN, None])
def test_sockets_from_other_origins_are_refused(
    client: httpx.Client, path: str, origin: str | None
) -> None:
    own = str(client.base_url).rstrip("/")
    named = None if origin is None else {"Origin": origin.format(port=client.base_url.port)}
    with pytest.raises(InvalidStatus) as caught:
        connect(own.replace("http", "ws") + path, additional_headers=named)
    assert caught.value.response.status_code == 403


def changing_requests(app: FastAPI) -> list[tuple[str, str]]:
    """Every way to change something, and two that nobody foresaw."""
    routes = [route for route in app.routes if isinstance(route, Route)]
    ways = [
        (method, re.sub("{[^}]*}", "x", route.path))
        for route in routes
        for method in sorted((route.methods or set()) - {"GET", "HEAD", "OPTIONS"})
    ]
    return [*ways, ("POST", "/"), ("PATCH", "/_dash-update-component"), ("PURGE", "/runs/import")]


@pytest.mark.parametrize("origin", FOREIGN)
def test_pages_from_elsewhere_change_nothing(
    client: httpx.Client, app: FastAPI, origin: str
) -> None:
    ways = changing_requests(app)
    assert ("POST", "/_dash-update-component") in ways and ("POST", "/runs/import") in ways
    named = {"Origin": origin.format(port=client.base_url.port)}
    for method, path in ways:
        assert client.request(method, path, json={}, headers=named).status_code == 403, path
        assert client.request(method, path, json={}).status_code != 403, path
    assert client.get("/runs", headers=named).status_code == 200


def test_what_a_browser_says_of_its_page_is_believed(client: httpx.Client) -> None:
    own = str(client.base_url).rstrip("/")
    elsewhere = own.replace("127.0.0.1", "localhost")
    path = "/_dash-update-component"
    # The update route has no words for an empty request; what matters is that it is asked.
    for headers in ({"Origin": own}, {"Origin": own.upper()}, {"Sec-Fetch-Site": "same-origin"}):
        assert client.post(path, json={}, headers=headers).status_code != 403, headers
    for headers in ({"Origin": elsewhere}, {"Sec-Fetch-Site": "cross-site"},
                    {"Origin": own, "Sec-Fetch-Site": "cross-site"}):  # fmt: skip
        assert client.post(path, json={}, headers=headers).status_code == 403, headers
    with pytest.raises(InvalidStatus) as caught:
        connect(own.replace("http", "ws") + "/_dash-ws-callback", origin=elsewhere)
    assert caught.value.response.status_code == 403
    connect(own.replace("http", "ws") + "/_dash-ws-callback", origin=own).close()


def test_large_bodies_are_refused_announced_or_not(client: httpx.Client) -> None:
    def drip() -> Iterator[bytes]:
        for _ in range(MAX_BODY_BYTES // 65_536 + 2):
            yield b" " * 65_536

    path = "/_dash-update-component"
    assert client.post(path, content=b" " * (MAX_BODY_BYTES + 1)).status_code == 413
    assert client.post(path, content=drip()).status_code == 413


def test_answers_carry_a_policy_without_inline_scripts(client: httpx.Client) -> None:
    headers = client.get("/").headers
    policy = dict(
        part.strip().split(" ", 1) for part in headers["content-security-policy"].split(";")
    )
    assert policy["default-src"] == "'none'"
    assert "unsafe" not in policy["script-src"]
    assert headers["x-content-type-options"] == "nosniff"


def test_interactive_figures_come_in_a_sandbox_without_a_network(client: httpx.Client) -> None:
    answer = client.get("/results/files/fig6.html")
    assert answer.status_code == 200
    policy = answer.headers["content-security-policy"]
    assert policy.startswith("sandbox allow-scripts; default-src 'none'")
    assert "connect-src" not in policy
    assert client.get("/results/files/fig6.png").headers["content-type"] == "image/png"


def test_no_callback_takes_the_place_of_another(client: httpx.Client) -> None:
    # Dash names a callback without outputs after its inputs alone: of two such, one never runs.
    names = [callback["output"] for callback in client.get("/_dash-dependencies").json()]
    assert len(names) > 20
    assert [name for name, n in Counter(names).items() if n > 1] == []


def test_a_taken_port_is_named_in_one_line(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        with pytest.raises(WorkerError, match=rf"port {port} .* is taken.*--port") as caught:
            serve(port=port, store_root=tmp_path)
    assert "\n" not in str(caught.value)
    assert not any(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("host", "port", "field"),
    [
        ("192.0.2.7", 8050, "host"),
        ("no.such.host.invalid", 8050, "host"),
        ("127.0.0.1", 70_000, "port"),
    ],
)
def test_an_address_that_cannot_be_served_is_named(host: str, port: int, field: str) -> None:
    with pytest.raises(InputError) as caught:
        serve(host=host, port=port)
    assert caught.value.field == field
