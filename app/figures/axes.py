"""Parts of every chart: the flight-time axis, the onset mark, decimation.

Figures are plain dictionaries in Plotly's JSON form; the tests check them against its schema.
"""

from base64 import b64encode
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tsdownsample import MinMaxDownsampler

from app import theme

Array = NDArray[np.floating[Any]]
Array32 = NDArray[np.float32]
Figure = dict[str, Any]

GRAPH_CONFIG: Any = {"displayModeBar": False, "doubleClick": "reset+autosize"}
"""How every `dcc.Graph` behaves."""

HOUR_S = 3600.0
_MIDNIGHT = np.datetime64("1970-01-01", "ms")
"""Start of the flight on a date axis, as in `fly/cursor.js`: zero in Plotly's milliseconds."""

_DOWNSAMPLER = MinMaxDownsampler()  # type: ignore[no-untyped-call]  # library


def moment(time_s: float) -> str:
    """Flight time for a Plotly date axis: a date as text, the flight beginning at midnight.

    Text, because a number there is shifted by the reader's time zone.
    """
    return str(_MIDNIGHT + np.timedelta64(round(1000.0 * time_s), "ms"))


def moments(time_s: Array) -> list[str]:
    """Flight times (n,) for a Plotly date axis, to the millisecond; see `moment`."""
    after_ms = np.rint(1000.0 * np.asarray(time_s, dtype=np.float64)).astype("timedelta64[ms]")
    texts: list[str] = np.datetime_as_string(_MIDNIGHT + after_ms).tolist()
    return texts


def along(time_s: Array) -> dict[str, Any]:
    """The x values of a Plotly trace at flight times (n,): start and step where they are regular.

    Times of every window in every trace, sent with each update, would be a third of all bytes.
    """
    steps_s = np.diff(time_s)
    if len(steps_s) and np.ptp(steps_s) < 1e-3:
        step_ms = 1000.0 * (time_s[-1] - time_s[0]) / len(steps_s)
        return {"x0": moment(float(time_s[0])), "dx": round(float(step_ms), 3)}
    return {"x": moments(time_s)}


def time_axis(duration_s: float, **extra: Any) -> dict[str, Any]:
    """The x axis of a flight of ``duration_s``: fixed from start to end, ticks as m:ss.

    A date axis, because Plotly then chooses ticks on whole seconds and minutes at every zoom.
    """
    whole = "%-H:%M:%S" if duration_s >= HOUR_S else "%-M:%S"
    return {
        "type": "date",
        "range": [moment(0.0), moment(duration_s)],
        "tickformat": whole,
        "hoverformat": whole + ".%1f",
        "nticks": 6,
        "showgrid": True,
        "zeroline": False,
        "ticks": "",
        **extra,
    }


def onset_mark(onset_s: float | None, *, label: str = "") -> list[dict[str, Any]]:
    """The vertical line where the fault sets in, over the whole height; none for a nominal run."""
    if onset_s is None:
        return []
    mark: dict[str, Any] = {
        "type": "line",
        "x0": moment(onset_s),
        "x1": moment(onset_s),
        "y0": 0,
        "y1": 1,
        "xref": "x",
        "yref": "paper",
        "line": {"color": theme.ONSET, "width": 1, "dash": "dot"},
        "name": "onset",
    }
    if label:
        mark["label"] = {
            "text": label,
            "textposition": "end",
            "textangle": 0,
            "font": {"size": 10, "color": theme.ONSET},
        }
    return [mark]


def base64_floats(values: Array) -> str:
    """An array as float32 in base64, row by row: shorter than decimal text, and quick to read."""
    return b64encode(np.ascontiguousarray(values, dtype=np.float32).tobytes()).decode()


def packed(values: Array) -> dict[str, str]:
    """An array as Plotly takes it in base64."""
    spec = {"dtype": "f4", "bdata": base64_floats(values)}
    if np.ndim(values) > 1:
        spec["shape"] = ", ".join(map(str, np.shape(values)))
    return spec


def kept_rows(time_s: Array, values: Array, n_out: int) -> NDArray[np.intp]:
    """The samples to draw, at most ``n_out`` in order, so that the line keeps every spike.

    The least and the greatest sample of ``n_out / 2 - 1`` stretches of equal length, found by
    ``tsdownsample``, and both ends. Not MinMaxLTTB, whose lines are a little smoother: of a spike
    and a dip in one stretch it keeps only one.
    """
    if len(time_s) <= n_out:
        return np.arange(len(time_s))
    x = np.ascontiguousarray(time_s, dtype=np.float64)
    y = np.ascontiguousarray(values, dtype=np.float32)
    extreme = _DOWNSAMPLER.downsample(x, y, n_out=2 * (n_out // 2 - 1))
    rows: NDArray[np.intp] = np.unique(np.concatenate([extreme, [0, len(x) - 1]])).astype(np.intp)
    return rows


def bare_layout(**extra: Any) -> dict[str, Any]:
    """A layout without colours of its own.

    Text and grid colours come from ``style.css``, so that the theme toggle needs no server.
    """
    return {
        "paper_bgcolor": "rgba(0,0,0,0)",
        "plot_bgcolor": "rgba(0,0,0,0)",
        "font": {"family": theme.FONT_FAMILY, "size": 10},
        "showlegend": False,
        "hovermode": "x unified",
        "dragmode": "zoom",
        "uirevision": "keep",
        **extra,
    }
