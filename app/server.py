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

from app import router, scripts, shell
from app.gate.access import TokenGate, link, names_of, sandbox_prefix, token_for
from app.gate.security import BodyLimit, SameOrigin, SecurityHeaders, content_security_policy
from app.kit.addresses import MISSING
from app.pages.fly.stream import RunStream
from app.pages.registry import PAGES, read_address
from app.recorder import Recorder, warm_up
from app.report_desk import ReportDesk
from app.scenes.recordings import Recordings
from app.scenes.viser_proxy import ViserScenes
from app.services import Services
from app.sessions import Sessions
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
"""How often runs deleted more than a day ago are removed from the disk."""

UNREAD_S = 30.0
"""A connection that accepts no data for so long is closed."""


def create_app(
    engine: Engine,
    store: RunStore,
    host: str = "127.0.0.1",
    port: int = 8050,
    token: str | None = None,
) -> FastAPI:
    """The whole app around an engine and its store, which the caller keeps and closes.

    ``host`` and ``port`` are where it is served; ``token`` is required of visitors, None for none.
    """
    scenes = ViserScenes()
    recordings = Recordings(store)
    recorder = Recorder(engine, store, recordings)
    desk = ReportDesk(store)

    @asynccontextmanager
    async def lifespan(_: FastAPI) -> AsyncIterator[None]:
        warming = asyncio.create_task(asyncio.to_thread(warm_up))
        emptying = asyncio.create_task(remove_deleted_runs(store))
        yield
        emptying.cancel()
        await warming
        await recorder.close()
        desk.close()
        scenes.close_all()

    server = FastAPI(docs_url=None, redoc_url=None, openapi_url=None, lifespan=lifespan)
    dash = _dash_app(server)
    services = Services(
        engine=engine,
        store=store,
        sessions=Sessions(scenes, RunStream(engine, store, desk)),
        recorder=recorder,
        desk=desk,
        classroom=Classroom(store, engine.fly_unseen),
        sandbox_prefix=sandbox_prefix(token),
    )
    router.register(dash, services)
    scenes.mount(server)
    recordings.mount(server)
    for page in PAGES:
        page.mount(server, services)
    _mount_addresses(server, dash, store)
    # Dash does this on the first request to a path of its own; the first one may name a page of
    # ours, which would come without its scripts and styles.
    dash._setup_server()  # type: ignore[no-untyped-call]  # dash
    policy = content_security_policy([*dash.csp_hashes(), _script_hash(_SCHEME_SCRIPT)])
    server.add_middleware(
        BodyLimit, uncounted=tuple(path for page in PAGES for path in page.uploads)
    )
    if token is not None:
        server.add_middleware(TokenGate, token=token, port=port)
    server.add_middleware(SameOrigin)
    server.add_middleware(TrustedHostMiddleware, allowed_hosts=names_of(host))
    server.add_middleware(SecurityHeaders, policy=policy, isolated=token is None)
    return server


async def remove_deleted_runs(store: RunStore, period_s: float = EMPTY_EVERY_S) -> None:
    """Remove deleted runs from the disk once their time to undo is over, forever."""
    while True:
        try:
            await asyncio.to_thread(empty, store)
        except StoreError as error:
            logger.warning("deleted runs stay on the disk for now: %s", error)
        await asyncio.sleep(period_s)


def serve(
    host: str = "127.0.0.1",
    port: int = 8050,
    scheduler: RemoteScheduler | None = None,
    store_root: Path | None = None,
) -> None:
    """Serve until Ctrl-C or SIGTERM, then leave no process behind.

    ``scheduler``: None for local workers. ``store_root``: folder
    of the runs, None for the default one. Elsewhere than on loopback it asks for a token, which is
    part of the link printed. Raises `InputError` for an address that is not this machine's own,
    `WorkerError` for a port that is taken or a scheduler that does not answer, and `StoreError` for
    a folder that cannot be read.
    """
    token = token_for(host)
    listener = _listen(host, port)
    # Uvicorn raises a signal again once it has stopped; this turns it into an orderly exit.
    signal.signal(signal.SIGTERM, _exit)
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
        on_error=router.report_unexpected,
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


def _mount_addresses(server: FastAPI, dash: Dash, store: RunStore) -> None:
    """Answer every address that a page has, and 404 with a page that says so to the rest.

    Dash alone answers 200 to any path. The last route here hides the catch-all that it adds.
    """

    @server.api_route("/{path:path}", methods=["GET", "HEAD"], include_in_schema=False)
    def page(path: str, request: Request) -> Response:
        token = set_current_request(request)  # type: ignore[no-untyped-call]  # dash
        try:
            address = read_address(f"/{path}", store)
            html = dash.index()  # type: ignore[no-untyped-call]  # dash
            return HTMLResponse(html, 404 if address.kind == MISSING else 200)
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
            raise InputError("host", f"{host!r} is not an address of this machine") from None
        why = "is taken" if error.errno == errno.EADDRINUSE else f"cannot be used: {error.strerror}"
        raise WorkerError(f"port {port} on {host} {why}; choose another with --port") from None
    close_unread(listener)  # what it accepts inherits this
    return listener


def close_unread(listener: socket.socket) -> None:
    """Have the system close connections that accept no data for `UNREAD_S`, where it can (Linux).

    Uvicorn notices by its pings that the other end is gone, but then closes gracefully, which
    never ends while there is data left to send.
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


def _exit(signum: int, frame: FrameType | None) -> NoReturn:
    raise SystemExit(0)
