"""The pictures and interactive figures of the experiments, from ``models/results``."""

from importlib.resources import files
from pathlib import Path

from fastapi import FastAPI, HTTPException, Request
from fastapi.responses import FileResponse

from core.experiments.registry import EXPERIMENTS
from core.paths import RESULTS

PREFIX = "/results/files/"

_NAMES = {name for item in EXPERIMENTS.values() for name in item.files}
_FILES = {
    f"{name}.{kind}": RESULTS / f"{name}.{kind}" for name in _NAMES for kind in ("png", "html")
}
# The script that the interactive pages look for beside them comes with Plotly itself.
_FILES["plotly.min.js"] = Path(str(files("plotly") / "package_data" / "plotly.min.js"))


def mount(server: FastAPI) -> None:
    """Serve the files of experiments; other files in the folder are not served."""

    @server.api_route(PREFIX + "{name}", methods=["GET", "HEAD"], include_in_schema=False)
    def result_file(name: str, request: Request) -> FileResponse:
        path = _FILES.get(name)
        if path is None or not path.is_file():
            raise HTTPException(404)
        headers = {"Cache-Control": "no-cache"}
        if name.endswith(".html"):
            headers["Content-Security-Policy"] = _policy(f"{request.base_url}".rstrip("/"))
        return FileResponse(path, headers=headers)


def _policy(origin: str) -> str:
    """The policy of an interactive figure, with its inline script: a sandbox without network."""
    return (
        f"sandbox allow-scripts; default-src 'none'; script-src {origin} 'unsafe-inline' "
        "'unsafe-eval'; style-src 'unsafe-inline'; img-src data: blob:; frame-ancestors 'none'"
    )
