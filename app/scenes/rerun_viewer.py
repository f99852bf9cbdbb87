"""Rerun's web viewer, served as static files: no second port, nothing from other servers.

The files come from the ``rerun-notebook`` wheel of the SDK's version, installed without its
dependencies (Jupyter's). It is located, never imported. The SDK carries a viewer too, but that
one calls home and can only be served by a server of its own.
"""

import asyncio
import gzip
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path

from fastapi import FastAPI, Request, Response
from fastapi.responses import FileResponse

from app.scenes.recording import narrow_layout
from core.errors import MirrorTwinError

VERSION = "0.41.0"
_STATIC = Path(__file__).parent / "static"
_LOOPBACK = ("127.0.0.1", "::1")

# The page runs in a sandbox, where its origin is opaque: to it, all of this is foreign.
ANY_ORIGIN = {"Access-Control-Allow-Origin": "*"}
_FOREVER = {**ANY_ORIGIN, "Cache-Control": "public, max-age=31536000, immutable"}


def _policy(origin: str) -> str:
    """The page's Content-Security-Policy; to an opaque origin, 'self' would mean nothing."""
    return (
        f"default-src 'none'; script-src {origin} 'wasm-unsafe-eval'; connect-src {origin}; "
        f"style-src 'unsafe-inline'; img-src data: blob:; worker-src blob:; "
        f"frame-ancestors {origin}; base-uri 'none'; form-action 'none'"
    )


@cache
def viewer_files() -> Path:
    """The folder of the viewer's files; raises `MirrorTwinError` if it is not installed."""
    hint = f"install it with: pip install --no-deps rerun-notebook=={VERSION}"
    spec = find_spec("rerun_notebook")
    if spec is None or spec.origin is None:
        raise MirrorTwinError(f"the Rerun viewer is not installed; {hint}")
    try:
        found = version("rerun-notebook")
    except PackageNotFoundError:
        found = "of an unknown version"
    if found != VERSION:
        raise MirrorTwinError(f"the Rerun viewer is {found}, not {VERSION}; {hint}")
    return Path(spec.origin).parent / "static"


@cache
def _widget() -> bytes:
    """The viewer as a module that exports its class; the wheel's only exports a notebook widget."""
    return (viewer_files() / "widget.js").read_bytes() + b"\nexport { WebViewer };\n"


@cache
def _packed_wasm() -> bytes:
    """The WebAssembly, gzipped: 17 MB instead of 67. Takes seconds, once."""
    return gzip.compress((viewer_files() / "re_viewer_bg.wasm").read_bytes(), 6, mtime=0)


def mount(app: FastAPI) -> None:
    """Add ``/rerun/viewer.html`` and its files. Call it before any catch-all route."""

    @app.get("/rerun/viewer.html", include_in_schema=False)
    async def page(request: Request, theme: str = "light") -> Response:
        try:
            viewer_files()
        except MirrorTwinError as error:
            return Response(str(error), status_code=503, media_type="text/plain")
        html = (_STATIC / "viewer.html").read_text(encoding="utf-8")
        html = html.replace("{version}", VERSION)
        html = html.replace("{theme}", "dark" if theme == "dark" else "light")
        headers = {
            "Content-Security-Policy": _policy(f"{request.url.scheme}://{request.url.netloc}"),
            "Cache-Control": "no-cache",
            "Referrer-Policy": "no-referrer",
            "X-Content-Type-Options": "nosniff",
        }
        return Response(html, media_type="text/html", headers=headers)

    @app.get("/rerun/narrow.rbl", include_in_schema=False)
    def narrow() -> Response:
        headers = {**ANY_ORIGIN, "Cache-Control": "no-cache"}
        return Response(narrow_layout(), media_type="application/octet-stream", headers=headers)

    @app.get(f"/rerun/{VERSION}/viewer.js", include_in_schema=False)
    async def script() -> Response:
        headers = {**ANY_ORIGIN, "Cache-Control": "no-cache"}
        return FileResponse(_STATIC / "viewer.js", media_type="text/javascript", headers=headers)

    @app.get(f"/rerun/{VERSION}/widget.js", include_in_schema=False)
    async def widget() -> Response:
        return Response(_widget(), media_type="text/javascript", headers=_FOREVER)

    @app.get(f"/rerun/{VERSION}/re_viewer_bg.wasm", include_in_schema=False)
    async def wasm(request: Request) -> Response:
        # On this machine copying 67 MB is faster than unpacking 17; over a network it is not.
        local = request.client is not None and request.client.host in _LOOPBACK
        packed = "gzip" in request.headers.get("accept-encoding", "")
        if local or not packed:
            path = viewer_files() / "re_viewer_bg.wasm"
            return FileResponse(path, media_type="application/wasm", headers=_FOREVER)
        headers = {**_FOREVER, "Content-Encoding": "gzip", "Vary": "Accept-Encoding"}
        body = await asyncio.to_thread(_packed_wasm)
        return Response(body, media_type="application/wasm", headers=headers)
