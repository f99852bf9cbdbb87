"""Security of every request and response, as plain ASGI middleware.

Plain, because Starlette's ``BaseHTTPMiddleware`` would buffer the growing recordings.
"""

from collections.abc import Sequence
from urllib.parse import urlsplit

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MAX_BODY_BYTES = 1 << 20
"""Far above the largest request of the app's own pages."""

_SAFE_METHODS = ("GET", "HEAD", "OPTIONS")
_DEFAULT_PORTS = {"http": 80, "https": 443}


def content_security_policy(script_hashes: Sequence[str]) -> str:
    """The policy of our own pages: nothing from elsewhere, no script that we did not write.

    ``script_hashes`` are those of Dash's inline scripts (``'sha256-...'``). Styles may be inline,
    because Mantine and Plotly set them on elements.
    """
    scripts = " ".join(script_hashes)
    return "; ".join(
        [
            "default-src 'none'",
            f"script-src 'self' {scripts}",
            "style-src 'self' 'unsafe-inline'",
            "img-src 'self' data: blob:",
            "font-src 'self' data:",
            "connect-src 'self'",
            "worker-src 'self' blob:",
            "frame-src 'self'",
            "frame-ancestors 'none'",
            "base-uri 'none'",
            "form-action 'none'",
        ]
    )


class SecurityHeaders:
    """Adds the security headers to every response that has not set its own."""

    def __init__(self, app: ASGIApp, policy: str, isolated: bool) -> None:
        """Wrap ``app``; ``policy`` is the Content-Security-Policy.

        ``isolated`` keeps other sites' windows apart from ours, which browsers heed, and do not
        complain of, on loopback only: we speak no TLS.
        """
        self._app = app
        self._headers = {
            "Content-Security-Policy": policy,
            "X-Content-Type-Options": "nosniff",
            "Referrer-Policy": "same-origin",
        }
        if isolated:
            self._headers["Cross-Origin-Opener-Policy"] = "same-origin"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return

        async def send_secured(message: Message) -> None:
            if message["type"] == "http.response.start":
                headers = MutableHeaders(scope=message)
                for name, value in self._headers.items():
                    headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_secured)


class SameOrigin:
    """Refuses changing requests that a browser sends for a page of another site: 403.

    Browsers let any page send to any server, and open sockets there; they do say truthfully whose
    page it is. A program that is no browser names no page and passes, but has no use for sockets.
    """

    def __init__(self, app: ASGIApp) -> None:
        """Wrap ``app``; the Host header must have been checked before."""
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or refuse it."""
        if scope["type"] == "websocket" and _is_foreign(scope, is_browser=True):
            # Before it is accepted: the browser sees HTTP 403.
            await send({"type": "websocket.close", "code": 1008})
        elif (
            scope["type"] == "http"
            and scope["method"] not in _SAFE_METHODS
            and _is_foreign(scope, is_browser=False)
        ):
            refusal = PlainTextResponse("Only pages of this server may do this.", 403)
            await refusal(scope, receive, send)
        else:
            await self._app(scope, receive, send)


def _is_foreign(scope: Scope, *, is_browser: bool) -> bool:
    """Whether the request names a page of another server.

    ``is_browser``: only browsers send such requests, so it must name a page.
    """
    headers = Headers(scope=scope)
    if headers.get("sec-fetch-site", "none") not in ("same-origin", "none"):
        return True
    scheme = {"ws": "http", "wss": "https"}.get(scope["scheme"], scope["scheme"])
    host = headers.get("host", "")
    # A TLS proxy in front of this server, which speaks none, need not say that it is there.
    own = {_origin(f"{scheme}://{host}"), _origin(f"https://{host}")} - {None}
    named = headers.getlist("origin") or ([""] if is_browser else [])
    return any(_origin(each) not in own for each in named)


def _origin(address: str) -> tuple[str, str, int] | None:
    """Scheme, host and port of a web address; None for anything else."""
    try:
        parts = urlsplit(address)
        port = parts.port or _DEFAULT_PORTS[parts.scheme]
    except (ValueError, KeyError):
        return None
    return (parts.scheme, parts.hostname, port) if parts.hostname else None


class BodyLimit:
    """Refuses requests whose body is larger than `MAX_BODY_BYTES`, announced or not."""

    def __init__(self, app: ASGIApp, uncounted: Sequence[str] = ()) -> None:
        """Wrap ``app``; the paths ``uncounted`` take files, and count their bytes themselves."""
        self._app = app
        self._uncounted = frozenset(uncounted)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, or answer 413."""
        if scope["type"] != "http" or scope["path"] in self._uncounted:
            await self._app(scope, receive, send)
            return
        announced = Headers(scope=scope).get("content-length", "0")
        if not announced.isdigit() or int(announced) > MAX_BODY_BYTES:
            await _too_large(scope, receive, send)
            return
        body = await _read(receive)
        if body is None:
            await _too_large(scope, receive, send)
            return
        pending = [body]

        async def replay() -> Message:
            return pending.pop() if pending else await receive()

        await self._app(scope, replay, send)


async def _read(receive: Receive) -> Message | None:
    """The whole body as one message, or None as soon as it is too large."""
    chunks: list[bytes] = []
    size = 0
    while True:
        message = await receive()
        if message["type"] != "http.request":
            return message  # the client has gone
        chunks.append(message.get("body", b""))
        size += len(chunks[-1])
        if size > MAX_BODY_BYTES:
            return None
        if not message.get("more_body", False):
            return {"type": "http.request", "body": b"".join(chunks), "more_body": False}


async def _too_large(scope: Scope, receive: Receive, send: Send) -> None:
    response = PlainTextResponse("The request is too large.", status_code=413)
    await response(scope, receive, send)
