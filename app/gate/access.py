"""Access by token where other machines can reach the server.

On loopback there is no gate. Elsewhere `mirrortwin serve` prints a link that ends in the token, as
Jupyter does; following it once sets a cookie, and nothing is answered without one or the other.
"""

import hmac
import os
import secrets
import socket
from ipaddress import ip_address
from urllib.parse import parse_qsl, urlencode

from starlette.datastructures import Headers
from starlette.requests import cookie_parser
from starlette.responses import PlainTextResponse, RedirectResponse, Response
from starlette.types import ASGIApp, Receive, Scope, Send

from core.errors import InputError

LOOPBACK_HOSTS = ("127.0.0.1", "localhost")
TOKEN_VARIABLE = "MIRRORTWIN_TOKEN"
MIN_TOKEN = 16

_UNBOUND = "0.0.0.0"
_SANDBOXED = ("/rerun/", "/recordings/", "/results/files/")
_COOKIE_S = 30 * 24 * 3600

_ASK = (
    "This server is not open to everyone. Open the link that `mirrortwin serve` printed on its "
    "terminal: it ends in ?token=..."
)


def token_for(host: str) -> str | None:
    """The token that a server on ``host`` requires; None on loopback.

    From ``MIRRORTWIN_TOKEN``, so that links outlive a restart, else a new one. Raises `InputError`
    for one that could be guessed.
    """
    if host in LOOPBACK_HOSTS:
        return None
    token = os.environ.get(TOKEN_VARIABLE, "")
    if token and (len(token) < MIN_TOKEN or not token.isascii()):
        raise InputError(TOKEN_VARIABLE, f"must have at least {MIN_TOKEN} ASCII characters")
    return token or secrets.token_urlsafe(24)


def names_of(host: str) -> list[str]:
    """The names and addresses of this server that a Host header may hold."""
    names = [*LOOPBACK_HOSTS, host]
    if host == _UNBOUND:
        own = socket.gethostname()
        names += [own, *_addresses(own), outward_address()]
    return list(dict.fromkeys(names))


def link(host: str, port: int, token: str | None) -> str:
    """The address to open, with its token."""
    reached = outward_address() if host == _UNBOUND else host
    address = f"http://{reached}:{port}"
    return address if token is None else f"{address}/?{urlencode({'token': token})}"


def outward_address() -> str:
    """The address of this machine towards other networks; loopback where it has none."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect(("192.0.2.1", 9))  # sends nothing: it only asks for the route
            return str(probe.getsockname()[0])
        except OSError:
            return LOOPBACK_HOSTS[0]


def sandbox_prefix(token: str | None) -> str:
    """The prefix of addresses that sandboxed pages may read: Rerun's viewer, Plotly's figures.

    A sandbox has no cookies. So it gets a key of its own, in the path, where relative addresses
    keep it; it opens the viewer, recordings and figures, and does not reveal the token.
    """
    if token is None:
        return ""
    return "/sandbox/" + hmac.digest(token.encode(), b"sandbox", "sha256").hex()[:40]


class TokenGate:
    """Middleware that answers only requests with the token: in a cookie, or once in the address."""

    def __init__(self, app: ASGIApp, token: str, port: int) -> None:
        """Wrap ``app``. ``port`` keeps the cookies of two servers of one machine apart."""
        self._app = app
        self._token = token
        self._cookie = f"mirrortwin-{port}"
        self._prefix = sandbox_prefix(token)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass the request on, ask for the token, or take it from the address."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
        elif inner := self._sandboxed(scope):
            await self._app(inner, receive, send)
        elif self._knows(scope):
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008})  # the browser sees HTTP 403
        else:
            await self._welcome(scope)(scope, receive, send)

    def _knows(self, scope: Scope) -> bool:
        # One by one: browsers send what every server of this host has set, however odd, and more
        # than one of a name where paths or domains differ. None of it may keep ours from counting.
        cookies = ";".join(Headers(scope=scope).getlist("cookie")).split(";")
        return any(self._is_token(cookie_parser(each).get(self._cookie, "")) for each in cookies)

    def _sandboxed(self, scope: Scope) -> Scope | None:
        """The request without its prefix, if that is valid and its path is open to a sandbox."""
        head, path = scope["path"][: len(self._prefix)], scope["path"][len(self._prefix) :]
        if scope["type"] != "http" or not hmac.compare_digest(head.encode(), self._prefix.encode()):
            return None
        if not path.startswith(_SANDBOXED):
            return None
        return {**scope, "path": path, "raw_path": path.encode()}

    def _welcome(self, scope: Scope) -> Response:
        asked = parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)
        if not self._is_token(dict(asked).get("token", "")) or scope["method"] != "GET":
            return PlainTextResponse(_ASK, 401)
        rest = urlencode([(name, value) for name, value in asked if name != "token"])
        # A path that begins with two slashes would lead to another server.
        path = "/" + scope["path"].lstrip("/\\")
        answer = RedirectResponse(path + (f"?{rest}" if rest else ""), 303)
        answer.set_cookie(
            self._cookie, self._token, max_age=_COOKIE_S, httponly=True, samesite="strict"
        )
        return answer

    def _is_token(self, offered: str) -> bool:
        return secrets.compare_digest(offered.encode(), self._token.encode())


def _addresses(name: str) -> list[str]:
    try:
        found = socket.getaddrinfo(name, None, socket.AF_INET)
    except OSError:
        return []
    return [str(ip_address(entry[4][0])) for entry in found]
