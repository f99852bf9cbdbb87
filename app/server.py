"""The web server: Dash on FastAPI, the 3D scenes and the recordings, all on one port."""

import asyncio
import errno
import gc
import hashlib
import logging
import signal
import socket
import sys
from base64 import b64encode
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from types import FrameType
from typing import NoReturn

import uvicorn
from dash import Dash
from dash.backends._fastapi import reset_current_request, set_current_request
from fastapi import FastAPI, Request, Response
from fastapi.responses import HTMLResponse
from starlette.middleware.trustedhost import TrustedHostMiddleware

from app import router as callbacks
from app import scripts, shell
from app.gate.access import TokenGate, link, names_of, sandbox_prefix, token_for
from app.gate.security import BodyLimit, SameOrigin, SecurityHeaders, content_security_policy
from app.pages.compare import callbacks as comparing
from app.pages.fly import detail
from app.pages.fly import scene_bar as scene_controls
from app.pages.fly.session import Sessions
from app.pages.report.files import mount as mount_reports
from app.pages.results import cell_runs
from app.pages.results import files as result_files
from app.pages.runs import files as run_files
from app.recorder import Recorder, warm_up
from app.report_desk import ReportDesk
from app.scenes.recordings import Recordings
from app.scenes.viser_proxy import ViserScenes
from app.services import Services
from core.errors import InputError, StoreError, WorkerError
from core.jobs.engine import Engine
from core.paths import WEB
from core.store.labels import empty
from core.store.store import RunStore, default_root
from core.teach.classroom import Classroom
from core.workers.scheduler import RemoteScheduler

# Sets the colours before the first paint, from the choice that Mantine remembers or the system's.
_SCHEME_SCRIPT = (
    "document.documentElement.dataset.mantineColorScheme="
    "({light:'light',dark:'dark'})[localStorage.getItem('mantine-color-scheme-value')]||"
    "(matchMedia('(prefers-color-scheme: dark)').matches?'dark':'light')"
)

_INDEX = f"""<!DOCTYPE html>
<html lang="en">
<head>
{{%metas%}}
<title>{{%title%}}</title>
<link rel="icon" href="/assets/icon.svg" type="image/svg+xml">
<script>{_SCHEME_SCRIPT}</script>
{scripts.tags()}
{{%css%}}
</head>
<body>
{{%app_entry%}}
<footer>{{%config%}}{{%scripts%}}{{%renderer%}}</footer>
</body>
</html>"""


logger = logging.getLogger(__name__)

EMPTY_EVERY_S = 600.0
"""How often runs are looked for that were thrown away a day ago."""

UNREAD_S = 30.0
"""A connection that takes nothing for so long is given up, with all that still waits for it."""


def create_app(
    engine: Engine,
    store: RunStore,
    host: str = "127.0.0.1",
    port: int = 8050,
    token: str | None = None,
) -> FastAPI:
    """The whole app around an engine and its store, which the caller keeps and closes.

    ``host`` and ``port`` are where it is served; ``token`` is what it asks for, None for nothing.
    """
    scenes = ViserScenes()
    recordings = Recordings(store)
    recorder = Recorder(engine, store, recordings)
    desk = ReportDesk(store)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        warming = asyncio.create_task(asyncio.to_thread(warm_up))
        emptying = asyncio.create_task(keep_emptying(store))
        yield
        emptying.cancel()
        await warming
        await recorder.close()
        desk.close()
        scenes.close_all()

    server = FastAPI(docs_url=None, redoc_url=None, openapi_url=None, lifespan=lifespan)
    dash = _dash_app(server)
    sessions = Sessions(engine, store, scenes, desk)
    sandbox = sandbox_prefix(token)
    classroom = Classroom(store, engine.fly_unseen)
    services = Services(engine, store, sessions, recorder, desk, classroom, sandbox)
    callbacks.register(dash, services)
    comparing.register(dash, engine, store, recorder)
    cell_runs.register(dash, engine, store, recorder)
    scene_controls.register(dash, sessions)
    scenes.mount(server)
    recordings.mount(server)
    mount_reports(server, store)
    result_files.mount(server)
    run_files.mount(server, store)
    detail.mount(server, engine, store)
    _mount_pages(server, dash, store)
    # Dash does this on the first request to a path of its own; the first one may name a page of
    # ours, which would come without its scripts and styles.
    dash._setup_server()  # type: ignore[no-untyped-call]  # dash
    policy = content_security_policy([*dash.csp_hashes(), _script_hash(_SCHEME_SCRIPT)])
    server.add_middleware(BodyLimit, uncounted=(run_files.IMPORT_PATH,))
    if token is not None:
        server.add_middleware(TokenGate, token=token, port=port)
    server.add_middleware(SameOrigin)
    server.add_middleware(TrustedHostMiddleware, allowed_hosts=names_of(host))
    server.add_middleware(SecurityHeaders, policy=policy, isolated=token is None)
    return server


async def keep_emptying(store: RunStore, period_s: float = EMPTY_EVERY_S) -> None:
    """Delete for good, now and ever again, what was thrown away long ago."""
    while True:
        try:
            await asyncio.to_thread(empty, store)
        except StoreError as error:
            logger.warning("what was thrown away stays for now: %s", error)
        await asyncio.sleep(period_s)


def serve(
    host: str = "127.0.0.1",
    port: int = 8050,
    scheduler: RemoteScheduler | None = None,
    store_root: Path | None = None,
) -> None:
    """Serve until told to stop (Ctrl-C or SIGTERM), then leave no process behind.

    ``scheduler``: None for workers of our own. ``store_root``: folder
    of the runs, None for the default one. Elsewhere than on loopback it asks for a token, which is
    part of the link printed. Raises `InputError` for an address that is not this machine's own,
    `WorkerError` for a port that is taken or a scheduler that does not answer, and `StoreError` for
    a folder that cannot be read.
    """
    token = token_for(host)
    listener = _listen(host, port)
    # Uvicorn raises a signal again once it has stopped; this turns it into an orderly exit.
    signal.signal(signal.SIGTERM, _leave)
    with listener:
        store = RunStore(store_root or default_root())
        try:
            engine = Engine(store, scheduler)
            try:
                if scheduler is not None and scheduler.warning:
                    print(scheduler.warning, file=sys.stderr)
                print(
                    f"MirrorTwin is at {link(host, port, token)} (Ctrl-C stops it)", file=sys.stderr
                )
                _run(create_app(engine, store, host, port, token), listener)
            finally:
                engine.close()
        finally:
            store.close()


def _dash_app(server: FastAPI) -> Dash:
    scripts.mount(server)
    dash = Dash(
        __name__,
        server=server,  # type: ignore[arg-type]  # declared for Flask; FastAPI is documented
        assets_folder=str(WEB),
        assets_path_ignore=[f"^{scripts.FOLDER}$"],
        index_string=_INDEX,
        title="MirrorTwin",
        update_title="",
        suppress_callback_exceptions=True,
        on_error=callbacks.tell,
        # A frame's updates travel together, so that the page renders once for all of them.
        websocket_batch_delay=0.005,
        # Never hang up on a page that merely waits.
        websocket_inactivity_timeout=0,
        enable_mcp=False,
        meta_tags=[{"name": "viewport", "content": "width=device-width, initial-scale=1"}],
    )
    dash.renderer = scripts.once_loaded(dash.renderer)
    dash.layout = shell.layout
    return dash


def _mount_pages(server: FastAPI, dash: Dash, store: RunStore) -> None:
    """Answer every address that a page has, and 404 with a page that says so to the rest.

    Dash alone answers 200 to any path. The last route here hides the catch-all that it adds.
    """

    @server.api_route("/{path:path}", methods=["GET", "HEAD"], include_in_schema=False)
    def page(path: str, request: Request) -> Response:
        token = set_current_request(request)  # type: ignore[no-untyped-call]  # dash
        try:
            address = shell.read_address(f"/{path}", store)
            html = dash.index()  # type: ignore[no-untyped-call]  # dash
            return HTMLResponse(html, 404 if address.kind == "missing" else 200)
        finally:
            reset_current_request(token)  # type: ignore[no-untyped-call]  # dash


def _script_hash(script: str) -> str:
    digest = b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return f"'sha256-{digest}'"


def _listen(host: str, port: int) -> socket.socket:
    """A listening socket; before anything else starts, so that a taken port costs nothing."""
    if not 1 <= port <= 65535:
        raise InputError("port", f"must lie in 1 to 65535, got {port}")
    try:
        listener = socket.create_server((host, port), backlog=128)
    except OSError as error:
        # Python hands on what failed to resolve as an OSError with the resolver's negative number.
        if error.errno == errno.EADDRNOTAVAIL or (error.errno or 0) < 0:
            raise InputError("host", f"{host!r} is no address of this machine") from None
        why = "is taken" if error.errno == errno.EADDRINUSE else f"cannot be used: {error.strerror}"
        raise WorkerError(f"port {port} on {host} {why}; choose another with --port") from None
    give_up_unread(listener)  # what it accepts inherits this
    return listener


def give_up_unread(listener: socket.socket) -> None:
    """Have the system end connections that take nothing for `UNREAD_S`, where it can (Linux).

    Uvicorn hears by its pings that the other end is gone, but then closes in good order, which
    never comes to an end while there is something left to send.
    """
    if option := getattr(socket, "TCP_USER_TIMEOUT", None):
        listener.setsockopt(socket.IPPROTO_TCP, option, round(UNREAD_S * 1000))


def _run(app: FastAPI, listener: socket.socket) -> None:
    config = uvicorn.Config(
        app,
        workers=1,  # sessions and scenes live in this process
        log_level="warning",
        access_log=False,
        ws_per_message_deflate=False,
        ws_max_size=1 << 20,
        timeout_graceful_shutdown=3,
    )
    # What has been loaded stays: looked through for garbage again and again, it would hold up all
    # pages for a third of a second every few.
    gc.collect()
    gc.freeze()
    uvicorn.Server(config).run(sockets=[listener])


def _leave(signum: int, frame: FrameType | None) -> NoReturn:
    raise SystemExit(0)
