"""A server that other machines can reach answers only those who bring its token."""

import asyncio
import re
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from hypothesis import given
from hypothesis import strategies as st
from starlette.responses import Response
from starlette.routing import Mount, Route, WebSocketRoute
from starlette.types import Message, Receive, Scope, Send
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.gate.access import TOKEN_VARIABLE, TokenGate, link, names_of, sandbox_prefix, token_for
from app.server import create_app
from core.errors import InputError
from core.fmea.fault import Fault
from core.jobs.engine import Engine
from core.store.store import RunStore
from core.twin.plan import Plan

TOKEN = "a-token-for-tests-only"


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> RunStore:
    return RunStore(tmp_path_factory.mktemp("store"))


@pytest.fixture(scope="module")
def served(store: RunStore, serve_app: Any) -> Iterator[tuple[FastAPI, str]]:
    """The app behind its token, and its address."""
    engine = Engine(store, n_workers=1)
    built: list[FastAPI] = []

    def build(port: int) -> FastAPI:
        built.append(create_app(engine, store, "0.0.0.0", port, TOKEN))
        return built[0]

    with serve_app(build) as url:
        yield built[0], url
    engine.close()


def paths(app: FastAPI, kind: type) -> list[str]:
    """Every path of that kind of route, with something in the place of each parameter."""
    found = [route.path for route in app.routes if isinstance(route, kind)]
    return [re.sub(r"{[^}]*}", "x", path) for path in found]


def test_no_route_answers_without_the_token(served: tuple[FastAPI, str]) -> None:
    app, address = served
    routes = [*paths(app, Route), *(path + "/x" for path in paths(app, Mount))]
    assert {
        "/runs/import",
        "/runs/files",
        "/runs/x/detail",
        "/results/files/x",
        "/viser/x/",
        "/recordings/x.rrd",
    } <= {*routes}
    guesses = [{}, {"token": "wrong"}, {"token": ""}]
    with httpx.Client(base_url=address, cookies={"mirrortwin-80": TOKEN}) as client:
        for path in [*routes, "/run/x", "/assets/style.css", "/sandbox/x/rerun/viewer.html"]:
            for method in ("GET", "POST", "HEAD", "PUT", "DELETE", "OPTIONS"):
                for guess in guesses:
                    answer = client.request(method, path, params=guess)
                    assert answer.status_code == 401, f"{method} {path} {guess}"
                    assert TOKEN not in answer.text


def test_no_socket_opens_without_the_token(served: tuple[FastAPI, str]) -> None:
    app, address = served
    sockets = paths(app, WebSocketRoute)
    assert len(sockets) >= 2
    for path in sockets:
        with pytest.raises(InvalidStatus) as caught:
            connect(address.replace("http", "ws") + path, origin=address)
        assert caught.value.response.status_code == 403, path


def test_the_link_opens_it_once_and_for_all(served: tuple[FastAPI, str]) -> None:
    _, address = served
    with httpx.Client(base_url=address) as client:
        first = client.get("/runs", params={"sort": "new", "token": TOKEN})
        assert first.status_code == 303
        assert first.headers["location"] == "/runs?sort=new"
        cookie = first.headers["set-cookie"].lower()
        assert "httponly" in cookie and "samesite=strict" in cookie
        assert client.get("/runs").status_code == 200
    with httpx.Client(base_url=address) as client:
        away = client.get(f"{address}//evil.example/x", params={"token": TOKEN})
        assert away.headers["location"] == "/evil.example/x"


def test_the_sandbox_may_read_recordings_and_nothing_else(
    served: tuple[FastAPI, str], store: RunStore
) -> None:
    _, address = served
    prefix = sandbox_prefix(TOKEN)
    run_id = store.create(Plan(), Fault()).id
    with httpx.Client(base_url=address) as client:
        # With the token, as the frame itself is asked for, and without, as what it loads.
        client.get("/", params={"token": TOKEN})
        assert client.get(f"{prefix}/rerun/viewer.html").status_code == 200
        client.cookies.clear()
        assert client.get(f"{prefix}/rerun/viewer.html").status_code == 200
        # A figure of ours, as the sandbox that its own policy makes of it reads its script.
        for name in ("fig6.html", "plotly.min.js"):
            assert client.get(f"{prefix}/results/files/{name}").status_code == 200
            assert client.get(f"/results/files/{name}").status_code == 401
        # Not stored yet, but it was looked for.
        assert client.get(f"{prefix}/recordings/{run_id}.rrd").status_code == 404
        for path in ("/", "/runs", f"/run/{run_id}", "/recordings", "/_dash-layout"):
            assert client.get(prefix + path).status_code == 401, path
    assert TOKEN not in prefix


NEIGHBOURS = [
    "a,b=1", "a/b=1", "(x)=1", 'j={"a":1}', "k=a b", "expires=1", "=1", "x", 'q="', "é=ü"
]  # fmt: skip
"""Cookies that other servers on this host may have left: browsers send them to every port."""


def knocks(address: str, name: str, cookies: str) -> int:
    """The answer to a request with that Cookie header, NAME standing for ours."""
    header = cookies.replace("NAME", name).encode("latin-1")
    return httpx.get(address, headers=[(b"Cookie", header)]).status_code


@pytest.mark.parametrize("odd", NEIGHBOURS)
def test_cookies_of_neighbours_are_harmless(served: tuple[FastAPI, str], odd: str) -> None:
    _, address = served
    name = f"mirrortwin-{address.rsplit(':', 1)[1]}"
    ours = f"NAME={TOKEN}"
    for header in (f"{odd}; {ours}", f"{ours}; {odd}", f"{odd};{ours};{odd}"):
        assert knocks(address, name, header) == 200, header
    for header in (odd, f"{odd}; NAME=wrong", f"NAME=wrong; {odd}", f"x{ours}", f"NAME ={TOKEN}x"):
        assert knocks(address, name, header) == 401, header
    # One of the same name that a neighbour has set for another path or domain.
    for header in (f"NAME=wrong; {ours}", f"{ours}; NAME=wrong"):
        assert knocks(address, name, header) == 200, header


class _Asked:
    """An application behind the gate that notes whether it was asked."""

    def __init__(self) -> None:
        self.is_asked = False

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.is_asked = True


def is_let_in(token: str, *cookies: bytes) -> bool:
    """Whether the gate passes on a request with those Cookie headers."""
    asked = _Asked()
    gate = TokenGate(asked, token=token, port=80)
    headers = [(b"cookie", cookie) for cookie in cookies]
    scope = {"type": "http", "method": "POST", "path": "/", "query_string": b"", "headers": headers}

    async def receive() -> Message:
        return {"type": "http.request"}

    async def send(message: Message) -> None:
        if message["type"] == "http.response.start":
            assert message["status"] == 401

    asyncio.run(gate(scope, receive, send))
    return asked.is_asked


ODD = st.binary(max_size=40).map(lambda raw: raw.replace(b"\n", b"").replace(b"\r", b""))


@given(before=ODD, after=ODD, other=ODD)
def test_no_cookie_locks_out_and_none_lets_in(before: bytes, after: bytes, other: bytes) -> None:
    ours = f"mirrortwin-80={TOKEN}".encode()
    assert is_let_in(TOKEN, before + b"; " + ours + b"; " + after)
    assert is_let_in(TOKEN, other, ours)
    assert not is_let_in(TOKEN, before + b"; " + after, other)


@given(token=st.text(st.characters(min_codepoint=32, max_codepoint=126), min_size=16))
def test_any_token_comes_back_as_it_was_set(token: str) -> None:
    answer = Response()
    answer.set_cookie("mirrortwin-80", token)
    assert is_let_in(token, answer.headers["set-cookie"].split("; Path=")[0].encode())


def test_hosts_that_are_not_this_machine_are_refused_all_the_same(
    served: tuple[FastAPI, str],
) -> None:
    _, address = served
    answer = httpx.get(address, params={"token": TOKEN}, headers={"Host": "evil.example"})
    assert answer.status_code == 400


def test_loopback_needs_no_token_and_everything_else_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(TOKEN_VARIABLE, raising=False)
    assert token_for("127.0.0.1") is None
    assert link("127.0.0.1", 8050, None) == "http://127.0.0.1:8050"
    one, another = token_for("0.0.0.0"), token_for("0.0.0.0")
    assert one is not None and len(one) >= 32 and one != another
    assert link("10.0.0.5", 80, "a b") == "http://10.0.0.5:80/?token=a+b"
    assert "10.0.0.5" in names_of("10.0.0.5")
    monkeypatch.setenv(TOKEN_VARIABLE, "short")
    with pytest.raises(InputError, match="16"):
        token_for("0.0.0.0")
    monkeypatch.setenv(TOKEN_VARIABLE, TOKEN)
    assert token_for("0.0.0.0") == TOKEN
