"""Table 5: what a diagnosis of one flight costs by four ways (paper section 6.6).

Everything is timed in this process on one thread, in CPU time, so that what else the machine does
is left out; medians over repetitions, each way in turn. The mirror is flown to the end of a 300 s
flight, of which the last 30 s are diagnosed. The surrogate runs over those 30 s and what it needs
to be warm; its baseline, taken once a flight, is known by then. Networks have the shipped sizes and
random weights: what they have learnt does not change what they cost.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median
from typing import Any, TypeVar

import numpy as np
import plotly.graph_objects as go
import torch

from core.arrays import Array32
from core.channels import CHANNELS, N_CHANNELS
from core.diagnosis.features import FEATURE_MODES, FeatureMode, Normalisation, n_features
from core.diagnosis.networks import Cnn1d
from core.diagnosis.trainer import device_name
from core.experiments.cost.bench import MEASURED_PLAN, bare_loop_s
from core.experiments.drawing import BLUE, GREEN, GREY, ORANGE, axis, finish
from core.experiments.paper.published import beside_paper
from core.experiments.results import Progress, Result
from core.fmea.catalogue import class_ids
from core.fmea.fault import Fault
from core.residual.controls import controls
from core.residual.gru import GruNetwork
from core.residual.surrogate import CHUNK, Surrogate
from core.residual.window import WINDOW_STEPS
from core.twin.flight import fly, fly_pair
from core.twin.trajectory import Pair, Trajectory

ROUNDS, QUICK_ROUNDS = 15, 3
FAULT = Fault("cylinder_compression", severity=0.8, onset_s=200.0)

LEAD_STEPS = 2 * CHUNK
"""What the surrogate reads before the window: to be warm, and to smooth the first second."""

Value = TypeVar("Value")

MEASURES = ("mirror_ms", "features_ms", "cnn_ms", "total_ms")

_PARTS = {"mirror_ms": ORANGE, "features_ms": BLUE, "cnn_ms": GREEN}


@dataclass(frozen=True, slots=True, eq=False)
class Scheme:
    """One way from a logged flight to probabilities."""

    mode: FeatureMode
    normalisation: Normalisation
    network: Cnn1d


def run(quick: bool, progress: Progress) -> Result:
    """Measure; raises `FlightError`."""
    torch.set_num_threads(1)
    rounds = QUICK_ROUNDS if quick else ROUNDS
    pair = fly_pair(MEASURED_PLAN, FAULT)
    surrogate = _surrogate(pair)
    schemes = [_scheme(mode, pair) for mode in FEATURE_MODES.values()]
    for scheme in schemes:
        _timed(scheme, pair, surrogate)  # caches and page faults belong to no round
    bare_ms: list[float] = []
    times: dict[str, list[dict[str, float]]] = {scheme.mode.name: [] for scheme in schemes}
    for done in range(rounds):
        bare_ms.append(1e3 * bare_loop_s(MEASURED_PLAN))
        for scheme in schemes:
            times[scheme.mode.name].append(_timed(scheme, pair, surrogate))
        progress((done + 1) / rounds)
    rows = [_row(scheme.mode, times[scheme.mode.name], bare_ms) for scheme in schemes]
    rows = beside_paper("table5", rows, MEASURES)
    for row in rows:
        row["times_faster_than_paper"] = row["paper_total_ms"] / row["total_ms"]
    return Result(
        name=f"table5-{MEASURED_PLAN.conditions}",
        settings={
            "quick": quick,
            "rounds": rounds,
            "conditions": MEASURED_PLAN.conditions,
            "plan": MEASURED_PLAN.to_dict(),
            "fault": FAULT.to_dict(),
            "device": device_name(),
            "time": "CPU milliseconds of one thread, medians over the rounds",
            "paper_device": "Intel Core i7-12700H: compare machines by bare_runs",
        },
        findings={"bare_run_ms": median(bare_ms), "rows": rows},
        figure=_figure(rows),
        summary=tuple(map(_line, rows)),
    )


def _surrogate(pair: Pair) -> Surrogate:
    channels = pair.mirror.channels
    return Surrogate(
        name="untrained",
        conditions="lab",
        fingerprint="",
        network=GruNetwork(10).eval(),
        channel_mean=channels.mean(axis=0),
        channel_sd=channels.std(axis=0),
        residual_sd=np.array([channel.noise_sd for channel in CHANNELS], dtype=np.float32),
        usual=np.ones(N_CHANNELS, dtype=np.float32),
    )


def _scheme(mode: FeatureMode, pair: Pair) -> Scheme:
    formed = mode.residual or (lambda each: each.residual)
    normalisation = Normalisation.fitted([(formed(pair), pair.faulted.channels)], mode)
    network = Cnn1d(n_features(mode.inputs), len(class_ids())).eval()
    return Scheme(mode, normalisation, network)


def _timed(scheme: Scheme, pair: Pair, surrogate: Surrogate) -> dict[str, float]:
    """Milliseconds of each part of one diagnosis."""
    mode = scheme.mode
    flight, mirror, mirror_ms = pair.faulted, pair.mirror, 0.0
    if mode.name == "paired":
        mirror, mirror_ms = _clocked(lambda: fly(MEASURED_PLAN))
    window = slice(len(flight) - WINDOW_STEPS, len(flight))

    def features() -> Array32:
        if mode.residual is not None:
            residual = mode.residual(Pair(flight[window], mirror[window]))
        else:
            residual = _predicted_away(flight, surrogate)
        return scheme.normalisation.features(residual, flight.channels[window], mode.inputs)

    shown, features_ms = _clocked(features)

    def answer() -> object:
        with torch.inference_mode():
            return torch.softmax(scheme.network(torch.from_numpy(shown)[None]), dim=1)

    _, cnn_ms = _clocked(answer)
    return {
        "mirror_ms": mirror_ms,
        "features_ms": features_ms,
        "cnn_ms": cnn_ms,
        "total_ms": mirror_ms + features_ms + cnn_ms,
    }


def _predicted_away(flight: Trajectory, surrogate: Surrogate) -> Array32:
    """The surrogate's residual in the last window, (1500, 23)."""
    first = len(flight) - WINDOW_STEPS - LEAD_STEPS
    commanded = controls(MEASURED_PLAN, first, len(flight) - first)
    residual: Array32 = surrogate.smoothed(flight.channels[first:], commanded)[LEAD_STEPS:]
    return residual


def _clocked(work: Callable[[], Value]) -> tuple[Value, float]:
    started = time.process_time()
    value = work()
    return value, 1e3 * (time.process_time() - started)


def _row(mode: FeatureMode, times: list[dict[str, float]], bare_ms: list[float]) -> dict[str, Any]:
    row: dict[str, Any] = {
        "scheme": mode.title,
        **{name: median(each[name] for each in times) for name in MEASURES},
    }
    if mode.name != "paired":
        row["mirror_ms"] = None
    ratios = [each["total_ms"] / bare for each, bare in zip(times, bare_ms, strict=True)]
    return row | {"bare_runs": median(ratios)}


def _line(row: dict[str, Any]) -> str:
    return (
        f"{row['scheme']:<36}{row['total_ms']:8.1f} ms ({row['bare_runs']:.2f} bare runs)   "
        f"paper: {row['paper_total_ms']:.1f} ms, {row['times_faster_than_paper']:.1f} times ours"
    )


def _figure(rows: list[dict[str, Any]]) -> go.Figure:
    """Ours in its parts beside the paper's total, milliseconds on a logarithmic axis."""
    figure = go.Figure()
    schemes = [row["scheme"] for row in rows]
    for part, colour in _PARTS.items():
        figure.add_bar(
            y=schemes, x=[row[part] for row in rows], orientation="h", marker_color=colour,
            name=part.removesuffix("_ms"),
        )  # fmt: skip
    figure.add_bar(
        y=schemes, x=[row["paper_total_ms"] for row in rows], orientation="h", marker_color=GREY,
        name="paper, total",
    )  # fmt: skip
    figure.update_xaxes(axis("Milliseconds", type="log"))
    figure.update_yaxes(axis(autorange="reversed", showgrid=False))
    return finish(
        figure, 900, 420, barmode="group", margin={"l": 270, "r": 30, "t": 60, "b": 60}
    )  # fmt: skip
