"""What an experiment leaves behind: its figures as JSON, a picture (PNG) and a page (HTML).

Pictures are made by kaleido, which prints Plotly figures with the Chromium that the browser tests
use: the picture and the page are then one figure. The pages of one folder share one copy of
plotly.js beside them, so that they open without a network.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from io import BytesIO
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
from PIL import Image

from core.errors import MirrorTwinError
from core.files import whole_file, write_error, write_json
from core.provenance import provenance

PIXELS_PER_POINT = 2.0
"""Pictures have twice the pixels of the page, so that they print sharply."""

Progress = Callable[[float], None]
"""Told the share of the work done, 0-1."""


@dataclass(frozen=True, slots=True, eq=False)
class Result:
    """An experiment's outcome.

    ``settings`` says what was flown and how (seeds, conditions, control mode), ``findings`` holds
    the keys of the JSON file that are the experiment's own, ``summary`` says them in a few lines.
    """

    name: str
    settings: Mapping[str, Any]
    findings: Mapping[str, Any]
    figure: go.Figure
    summary: tuple[str, ...]

    def to_dict(self) -> dict[str, Any]:
        """The content of the JSON file: settings, origin, then the findings at the top level."""
        return {
            "experiment": self.name,
            "made_at": datetime.now(UTC).isoformat(timespec="seconds"),
            "settings": dict(self.settings),
            "provenance": provenance(),
            **self.findings,
        }


def write_result(result: Result, folder: Path) -> dict[str, Any]:
    """Write ``NAME.json``, ``NAME.html`` and ``NAME.png``; returns what the JSON file holds.

    Raises `StoreError` where the folder cannot be written to, and `MirrorTwinError` where no
    browser can print the picture; JSON and page have been written by then.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise write_error(folder, error) from error
    content = result.to_dict()
    write_json(folder / f"{result.name}.json", content)
    _write_page(result, folder / f"{result.name}.html")
    _write_picture(result.figure, folder / f"{result.name}.png")
    return content


def _write_page(result: Result, path: Path) -> None:
    try:
        result.figure.write_html(
            path,
            include_plotlyjs="directory",
            div_id=result.name,
            config={"displaylogo": False, "responsive": True},
        )
    except OSError as error:
        raise write_error(path.parent, error) from error


def _write_picture(figure: go.Figure, path: Path) -> None:
    problem = f"no picture {path.name} (JSON and HTML are written): "
    try:
        import kaleido
    except ImportError:
        raise MirrorTwinError(problem + "kaleido is missing; `make test` installs it") from None
    size = {"width": figure.layout.width, "height": figure.layout.height}
    try:
        picture: bytes = kaleido.calc_fig_sync(
            figure, opts={"format": "png", "scale": PIXELS_PER_POINT, **size}
        )
    except Exception as error:  # the browser's ways to fail are many and share no base
        reason = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise MirrorTwinError(
            f"{problem}{reason} Install Chromium (`make test` does) or name one in BROWSER_PATH"
        ) from error
    with whole_file(path) as temporary:
        _few_colours(picture).save(temporary, format="png", optimize=True)


def _few_colours(picture: bytes) -> Image.Image:
    """The picture on its 256 most telling colours: line art takes a quarter of the space so."""
    full = Image.open(BytesIO(picture)).convert("RGB")
    return full.quantize(256, method=Image.Quantize.MAXCOVERAGE, kmeans=1, dither=Image.Dither.NONE)
