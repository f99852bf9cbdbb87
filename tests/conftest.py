"""Fixtures shared by all tests: a server as a user starts it, and a real Chromium."""

import ctypes.util
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NoReturn

import pytest
import uvicorn
from playwright.sync_api import BrowserContext, Page

COMMAND = str(Path(sys.executable).with_name("mirrortwin"))
CHROMIUM = Path("/usr/bin/chromium")
START_S = 180.0
STOP_S = 10.0


BROWSERS = 2
"""So many groups of browser tests, which run side by side at the very end."""


def _lateness(item: pytest.Item) -> int:
    late = [item.get_closest_marker(name) is not None for name in ("alone", "browser")]
    return late[0] + 2 * late[1]


@pytest.hookimpl(wrapper=True, tryfirst=True)  # around pytest-xdist, which reads the groups in it
def pytest_collection_modifyitems(items: list[pytest.Item]) -> Iterator[None]:
    """Say what may run beside what, and what comes last.

    Files run side by side (``pytest -n 2 --dist loadgroup``); of those marked ``alone``, which kill
    processes and fill disks, one at a time. Browser tests are the very last: from the first on,
    Playwright's event loop owns the thread. Nothing relies on having the machine for itself: tests
    wait for states.
    """
    files = sorted({str(item.path) for item in items if item.get_closest_marker("browser")})
    for item in items:
        match _lateness(item):
            case 0:
                group = str(item.path)
            case 1:
                group = "alone"
            case _:
                group = f"browser {files.index(str(item.path)) % BROWSERS}"
        item.add_marker(pytest.mark.xdist_group(group))
    yield
    items.sort(key=_lateness)  # last: pytest moves tests that share a parametrised fixture together


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


@pytest.fixture
def free_port() -> int:
    """A TCP port that nothing listens on."""
    return _free_port()


@dataclass
class Server:
    """A running ``mirrortwin serve``; ``store`` is its folder, ``log`` all that it printed."""

    process: "subprocess.Popen[bytes]"
    port: int
    store: Path
    log: Path
    url: str = field(init=False)

    def __post_init__(self) -> None:
        self.url = f"http://127.0.0.1:{self.port}"

    def wait_until_up(self) -> None:
        """Return once the page is served; fail with the log if the server stops or stalls."""
        deadline = time.monotonic() + START_S
        while time.monotonic() < deadline:
            if self.process.poll() is not None:
                break
            try:
                with urllib.request.urlopen(self.url, timeout=2):
                    return
            except urllib.error.HTTPError:
                return  # it asks for a token
            except OSError:
                time.sleep(0.1)
        self._fail("did not come up")

    def stop(self) -> int:
        """Ask the server to end, as Ctrl-C or a service manager does, and return its status."""
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGTERM)
        try:
            return self.process.wait(STOP_S)
        except subprocess.TimeoutExpired:
            self._fail(f"outlived TERM by {STOP_S:g} s")

    def _fail(self, problem: str) -> NoReturn:
        self.process.kill()
        pytest.fail(f"the server {problem}:\n{self.log.read_text()[-4000:]}")


def _start(folder: Path, *options: str, store: Path | None = None) -> Server:
    port, log, store = _free_port(), folder / "server.log", store or folder / "store"
    command = [COMMAND, "serve", "--port", str(port), "--store", str(store), *options]
    with log.open("wb") as output:
        process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT, cwd=folder)
    running = Server(process, port, store, log)
    running.wait_until_up()
    return running


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """One server for all tests that leave it as it was."""
    running = _start(tmp_path_factory.mktemp("server"))
    yield running
    running.stop()


@pytest.fixture(scope="module")
def start_one_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[], Server]]:
    """Start servers for all tests of a module, in the environment of the moment."""
    started: list[Server] = []

    def start() -> Server:
        started.append(_start(tmp_path_factory.mktemp("server")))
        return started[-1]

    yield start
    for running in started:
        running.stop()


@pytest.fixture
def start_server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[..., Server]]:
    """Start servers of the test's own: ``start_server("--scheduler", address, store=path)``."""
    started: list[Server] = []

    def start(*options: str, store: Path | None = None) -> Server:
        started.append(_start(tmp_path_factory.mktemp("server"), *options, store=store))
        return started[-1]

    yield start
    for running in started:
        running.stop()


@contextmanager
def _served(build: Callable[[int], Any], **config: Any) -> Iterator[str]:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
        running = uvicorn.Server(uvicorn.Config(build(port), log_level="error", **config))
        thread = threading.Thread(target=running.run, kwargs={"sockets": [listener]})
        thread.start()
        while not running.started:
            time.sleep(0.01)
        try:
            yield f"http://127.0.0.1:{port}"
        finally:
            running.should_exit = True
            thread.join()


@pytest.fixture(scope="session")
def serve_app() -> Callable[..., AbstractContextManager[str]]:
    """What ``build(port)`` makes, served in a thread while a ``with`` lasts; its value is the URL.

    For tests that need its parts at hand; what else is given goes to uvicorn's configuration.
    """
    return _served


@pytest.fixture(scope="session")
def browser_type_launch_args(browser_type_launch_args: dict[str, Any]) -> dict[str, Any]:
    """Debian's Chromium where it is, and WebGL in software: on Mesa, twice as fast, if present."""
    webgl = ["--enable-unsafe-swiftshader"]
    if ctypes.util.find_library("EGL_mesa"):
        webgl = ["--use-gl=angle", "--use-angle=gl-egl", "--ignore-gpu-blocklist"]
    quiet = ["--no-sandbox", "--disable-background-networking", "--disable-component-update"]
    chromium = {"executable_path": str(CHROMIUM)} if CHROMIUM.exists() else {}
    return {**browser_type_launch_args, **chromium, "args": [*quiet, *webgl]}


@pytest.fixture
def console_errors(page: Page) -> list[str]:
    """What ``page`` complained of so far: console errors and uncaught exceptions."""
    complaints: list[str] = []
    page.on("console", lambda line: complaints.append(line.text) if line.type == "error" else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    return complaints


@pytest.fixture
def without_3d(context: BrowserContext) -> None:
    """Leave the live 3D view empty: drawn in software it takes most of the machine.

    For tests that are about something else; `test_scenes`, `test_fly` and `test_everyone` draw it.
    """
    context.route(
        "**/viser/**",
        lambda route: route.fulfill(body="<!doctype html>", content_type="text/html"),
    )
