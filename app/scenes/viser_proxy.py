"""Every session's viser scene behind the app's one port: its page and its socket.

Reached at ``/viser/{session}/``, which the browser shows in a same-origin iframe (viser's client
does not connect from a sandboxed one).
"""

import asyncio
import gzip
import re
import threading
import time
from functools import cache
from pathlib import Path

import viser
import websockets.exceptions
from fastapi import FastAPI, Request, Response, WebSocket, WebSocketDisconnect
from fastapi.responses import RedirectResponse
from websockets.asyncio.client import ClientConnection, connect
from websockets.typing import Subprotocol

from app import theme
from app.scenes.palette import DARK, LIGHT, Palette
from app.scenes.viser_scene import KEY_HEADER, ViserScene
from core.errors import InputError

_SESSION = re.compile(r"[A-Za-z0-9_-]{16,64}")
_IDLE_S = 3600.0
"""A scene without a viewer or a drawing for this long is closed."""

# The client's WebAssembly glue makes functions from strings, hence 'unsafe-eval'.
_CSP = (
    "default-src 'none'; script-src 'unsafe-inline' 'unsafe-eval' blob: data:; "
    "style-src 'unsafe-inline'; img-src data: blob:; font-src data:; worker-src blob: data:; "
    "connect-src 'self' ws://{host} wss://{host} data: blob:; frame-ancestors 'self'; "
    "base-uri 'none'; form-action 'none'"
)

# The client reconnects only while its document has the focus, which an iframe rarely has. Its
# control panel and its notice about software rendering are for viser's own users. It fades the
# canvas in, and leaves it half faded if the server's environment map comes before the fade ends.
_INJECTED = """<script>document.hasFocus = () => true;</script>
<style>
html, body { background: %(light_bottom)s; }
canvas[data-engine] {
  background: linear-gradient(%(light_top)s, %(light_bottom)s); opacity: 1 !important;
}
[data-mantine-color-scheme="dark"] body { background: %(dark_bottom)s; }
[data-mantine-color-scheme="dark"] canvas[data-engine] {
  background: linear-gradient(%(dark_top)s, %(dark_bottom)s);
}
#root .mantine-Paper-root, #webgl-software-rendering { display: none !important; }
#scale {
  position: fixed; right: 12px; bottom: 8px; z-index: 5; pointer-events: none;
  font: 12px/1.5 %(font)s; color: %(light_text)s; opacity: 0.75;
}
[data-mantine-color-scheme="dark"] #scale { color: %(dark_text)s; }
</style>
"""
_SCALE = '<div id="scale">Grid 1 km, heights drawn &times;%g</div>'


def _css(colour: tuple[int, int, int]) -> str:
    return "#{:02x}{:02x}{:02x}".format(*colour)


def _colours(name: str, colours: Palette) -> dict[str, str]:
    return {
        f"{name}_top": _css(colours.sky_top),
        f"{name}_bottom": _css(colours.sky_bottom),
        f"{name}_text": _css(colours.text),
    }


@cache
def _page() -> bytes:
    """The client that viser ships, one HTML file, with our sky and scale; gzipped."""
    build = Path(viser.__file__).parent / "client" / "build" / "index.html"
    style = {"font": theme.FONT_FAMILY} | _colours("light", LIGHT) | _colours("dark", DARK)
    html = build.read_text(encoding="utf-8")
    html = html.replace("</head>", _INJECTED % style + "</head>", 1)
    html = html.replace("</body>", _SCALE % theme.VERTICAL_SCALE + "</body>", 1)
    return gzip.compress(html.encode(), compresslevel=6, mtime=0)


class ViserScenes:
    """The scenes of all open browser sessions. Safe to use from any thread.

    A session id is the only thing that opens a scene, so it must be unguessable: 16 or more
    URL-safe characters, such as ``secrets.token_urlsafe(16)`` gives.
    """

    def __init__(self, idle_s: float = _IDLE_S) -> None:
        """Start with no scene; each is closed after ``idle_s`` without a viewer or a drawing."""
        self._idle_s = idle_s
        self._lock = threading.Lock()
        self._scenes: dict[str, ViserScene] = {}
        self._used: dict[str, float] = {}

    def open(self, session: str) -> ViserScene:
        """The scene of a session, started if there is none yet (some 5 ms).

        Raises `InputError` for an id that could be guessed.
        """
        if not _SESSION.fullmatch(session):
            raise InputError("session", "must be 16 to 64 letters, digits, - or _")
        with self._lock:
            self._used[session] = time.monotonic()
            idle = self._idle(time.monotonic())
            scene = self._scenes.get(session)
            if scene is None:
                scene = self._scenes[session] = ViserScene()
        for session_id in idle:
            self.close(session_id)
        return scene

    def close(self, session: str) -> None:
        """Stop a session's scene and disconnect its pages; nothing happens if there is none."""
        with self._lock:
            scene = self._scenes.pop(session, None)
            self._used.pop(session, None)
        if scene is not None:
            # Stopping waits for the scene's thread, for up to a second; nobody need wait for that.
            threading.Thread(target=scene.stop, name="viser-stop").start()

    def close_all(self) -> None:
        """Stop every scene."""
        for session in list(self._scenes):
            self.close(session)

    def find(self, session: str) -> ViserScene | None:
        """The scene of a session, if it is open."""
        with self._lock:
            scene = self._scenes.get(session)
            if scene is not None:
                self._used[session] = time.monotonic()
        return scene

    def _idle(self, now: float) -> list[str]:
        return [
            session
            for session, scene in self._scenes.items()
            if now - self._used[session] > self._idle_s and scene.viewers == 0
        ]

    def mount(self, app: FastAPI) -> None:
        """Add ``/viser/{session}/`` and its socket. Call it before any catch-all route."""

        @app.get("/viser/{session}", include_in_schema=False)
        async def add_slash(session: str, request: Request) -> Response:
            return RedirectResponse(request.url.replace(path=f"/viser/{session}/"))

        @app.get("/viser/{session}/", include_in_schema=False)
        async def page(session: str, request: Request) -> Response:
            if self.find(session) is None:
                return Response("No such scene.", status_code=404, media_type="text/plain")
            body = await asyncio.to_thread(_page)
            headers = {
                "Content-Encoding": "gzip",
                "Content-Security-Policy": _CSP.format(host=request.url.netloc),
                "Cache-Control": "no-store",
                "Referrer-Policy": "no-referrer",
                "X-Content-Type-Options": "nosniff",
            }
            return Response(body, media_type="text/html; charset=utf-8", headers=headers)

        @app.websocket("/viser/{session}")
        async def socket(browser: WebSocket, session: str) -> None:
            scene = self.find(session)
            if scene is None:
                await browser.close(1008)  # before accepting: the browser sees HTTP 403
                return
            await asyncio.to_thread(scene.watch)
            try:
                await _relay(browser, scene)
            finally:
                scene.leave()


async def _relay(browser: WebSocket, scene: ViserScene) -> None:
    """Carry messages both ways until either end goes."""
    protocols = [Subprotocol(name) for name in browser.scope["subprotocols"]]
    try:
        async with connect(
            f"ws://127.0.0.1:{scene.port}/",
            subprotocols=protocols or None,
            additional_headers={KEY_HEADER: scene.key},
            compression=None,
            max_size=None,
            proxy=None,
        ) as upstream:
            await browser.accept(subprotocol=upstream.subprotocol)
            ways = [
                asyncio.create_task(_to_browser(upstream, browser)),
                asyncio.create_task(_to_viser(browser, upstream)),
            ]
            _, pending = await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            for way in pending:
                way.cancel()
            await asyncio.gather(*ways, return_exceptions=True)
    except (OSError, websockets.exceptions.WebSocketException):
        pass  # the scene has been stopped meanwhile
    if browser.client_state.name == "CONNECTED" and browser.application_state.name == "CONNECTED":
        await browser.close(1001)


async def _to_browser(upstream: ClientConnection, browser: WebSocket) -> None:
    async for message in upstream:
        if isinstance(message, bytes):
            await browser.send_bytes(message)


async def _to_viser(browser: WebSocket, upstream: ClientConnection) -> None:
    try:
        while True:
            await upstream.send(await browser.receive_bytes())
    except (WebSocketDisconnect, websockets.exceptions.ConnectionClosed):
        return
