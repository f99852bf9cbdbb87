"""Models trained in lab and in field, each tested in both, and what each channel has to do with it.

The two data sets hold the same flights, run by run: the same plans, seeds and faults, once in still
air with sensors that read aircraft and mirror alike, once in weather with sensor noise of their
own. So a channel of a field flight can be shown to a model as it reads in lab, everything else left
as it is; the score that this wins back is what that channel's troubles cost.
"""

from collections.abc import Iterable
from pathlib import Path
from typing import Any, cast

import numpy as np
import plotly.graph_objects as go
import torch
from numpy.typing import NDArray

from core.channels import CHANNEL_NAMES, CHANNELS, N_CHANNELS
from core.dataset.archive import read_manifest
from core.diagnosis.corpus import Corpus
from core.diagnosis.features import FEATURE_ROWS, N_FEATURES, pooled
from core.diagnosis.predict import Diagnoser, Residual, load_diagnoser
from core.diagnosis.scores import macro_f1, scores
from core.errors import InputError
from core.experiments.drawing import RESIDUAL_COLOURS, axis, finish
from core.experiments.models.fresh import RESIDUALS
from core.experiments.results import Progress, Result
from core.fmea.catalogue import class_ids
from core.residual.window import WINDOW_STEPS
from core.twin.plan import Conditions

CONDITIONS: tuple[Conditions, ...] = ("lab", "field")
BATCH = 64
QUICK_RUNS = 40

Features = NDArray[np.float32]
Row = dict[str, Any]


def run(quick: bool, progress: Progress, data: Path = Path("data")) -> Result:
    """Test the shipped models on ``data/lab`` and ``data/field``.

    Raises `InputError` where the two are not the same flights, `MirrorTwinError` where a model is
    missing.
    """
    manifests = {each: read_manifest(data / each) for each in CONDITIONS}
    planned = {each: [run.id for run in manifests[each].part("test")] for each in CONDITIONS}
    if planned["lab"] != planned["field"]:
        raise InputError("data", f"{data}/lab and {data}/field do not hold the same flights")
    rows: list[Row] = []
    channels: list[Row] = []
    for done, (residual, trained) in enumerate((r, c) for r in RESIDUALS for c in CONDITIONS):
        diagnoser = load_diagnoser(residual, conditions=trained)
        corpora = {
            each: _corpus(data / each, each, diagnoser, QUICK_RUNS if quick else None)
            for each in CONDITIONS
        }
        rows += [_row(diagnoser, residual, corpora[each], each) for each in CONDITIONS]
        channels += _by_channel(diagnoser, residual, corpora)
        progress((done + 1) / (len(RESIDUALS) * len(CONDITIONS)))
    return Result(
        name="cross",
        settings={
            "quick": quick,
            "data": {each: manifests[each].spec for each in CONDITIONS},
            "scored_on": "windows of 30 s that tile the 120 s after each test fault first shows",
        },
        findings={"rows": rows, "channels": channels},
        figure=_figure(channels),
        summary=(*map(_line, rows), *_worst(channels)),
    )


def _corpus(folder: Path, conditions: str, diagnoser: Diagnoser, n_runs: int | None) -> Corpus:
    runs = read_manifest(folder).part("test")
    return Corpus(
        folder, runs[:: max(1, len(runs) // n_runs)] if n_runs else runs, class_ids(),
        diagnoser.mode, diagnoser.inputs, diagnoser.surrogate,
    )  # fmt: skip


def _features(corpus: Corpus, diagnoser: Diagnoser) -> Features:
    """Every scored window, (n, 46, 150), or (n, 23, 150) of a half."""
    return np.concatenate(list(corpus.scored_batches(diagnoser.normalisation, BATCH)))


def _answers(diagnoser: Diagnoser, windows: Features) -> NDArray[np.float32]:
    """Logits (n, 20)."""
    with torch.inference_mode():
        found = [diagnoser.network(batch).numpy() for batch in torch.from_numpy(windows).split(256)]
    return np.concatenate(found)


def _row(diagnoser: Diagnoser, residual: Residual, corpus: Corpus, tested: Conditions) -> Row:
    found = _answers(diagnoser, _features(corpus, diagnoser))
    scored = scores(corpus.truth(), found.argmax(axis=1), corpus.classes)
    refused = diagnoser.calibration.energy(found) > diagnoser.calibration.threshold
    return {
        "scheme": f"{residual}, trained in {diagnoser.conditions}, tested in {tested}",
        "residual": residual,
        "trained": diagnoser.conditions,
        "tested": tested,
        "refused_share": float(refused.mean()),
        **{name: scored[name] for name in ("n", "accuracy", "macro_f1", "per_class_f1")},
        "confusion": scored["confusion"],
        "confused": scored["confused"],
    }


def _by_channel(
    diagnoser: Diagnoser, residual: Residual, corpora: dict[Conditions, Corpus]
) -> list[Row]:
    """For each channel, the score in field when that channel alone reads as in lab."""
    lab, field = corpora["lab"], corpora["field"]
    # The same stretches of the same flights, as far as both data sets have kept them.
    lab.scored = field.scored = [
        window
        for window in field.scored
        if window.start_row + WINDOW_STEPS <= lab.stretches[window.run].n_rows
    ]
    as_flown, as_in_lab = _features(field, diagnoser), _features(lab, diagnoser)
    truth = field.truth()

    def score(windows: Features) -> float:
        found = _answers(diagnoser, windows).argmax(axis=1)
        return macro_f1(truth, found, len(field.classes))

    base = score(as_flown)
    strays = {each: _healthy_sd(corpora[each]) for each in CONDITIONS}
    gains = []
    for number, name in enumerate(CHANNEL_NAMES):
        mixed = as_flown.copy()
        rows = _rows(number, diagnoser)
        mixed[:, rows] = as_in_lab[:, rows]
        better = score(mixed)
        gains.append(
            {
                "residual": residual,
                "trained": diagnoser.conditions,
                "channel": name,
                "macro_f1_with_lab_channel": better,
                "gain": better - base,
                **{f"healthy_sd_{each}": float(strays[each][number]) for each in CONDITIONS},
                "noise_sd": CHANNELS[number].noise_sd,
            }
        )
    return gains


def _rows(channel: int, diagnoser: Diagnoser) -> list[int]:
    """Where the classifier sees that channel's residual and reading, those that it is shown."""
    shown = range(*FEATURE_ROWS[diagnoser.inputs].indices(N_FEATURES))
    return [shown.index(row) for row in (channel, channel + N_CHANNELS) if row in shown]


def _healthy_sd(corpus: Corpus) -> NDArray[np.float64]:
    """How far healthy flights' residuals stray, means of 0.2 s, (23,), as the mode forms them."""
    healthy = [
        pooled(residual)
        for (residual, _), run in zip(corpus.flights(), corpus.runs, strict=True)
        if run.mode == "nominal"
    ]
    return cast("NDArray[np.float64]", np.concatenate(healthy).std(axis=0, dtype=np.float64))


def _line(row: Row) -> str:
    return f"{row['scheme']:<48} macro-F1 {row['macro_f1']:.3f}"


def _worst(channels: Iterable[Row]) -> Iterable[str]:
    ours = [each for each in channels if _is_trained_in_lab(each, "paired")]
    for each in sorted(ours, key=lambda row: -row["gain"])[:5]:
        yield f"  {each['channel']:<10} as in lab wins back {each['gain']:+.3f} (paired, lab model)"


def _is_trained_in_lab(row: Row, residual: str) -> bool:
    return (row["residual"], row["trained"]) == (residual, "lab")


def _figure(channels: list[Row]) -> go.Figure:
    """What each channel wins back, of the models trained in lab."""
    figure = go.Figure()
    for residual, colour in RESIDUAL_COLOURS.items():
        chosen = [each for each in channels if _is_trained_in_lab(each, residual)]
        figure.add_bar(
            y=[each["channel"] for each in chosen], x=[each["gain"] for each in chosen],
            name=residual, orientation="h", marker_color=colour,
        )  # fmt: skip
    figure.update_xaxes(axis("Macro-F1 in field won back when this channel alone reads as in lab"))
    figure.update_yaxes(axis(autorange="reversed", showgrid=False))
    return finish(
        figure, 900, 760, barmode="group", margin={"l": 110, "r": 30, "t": 60, "b": 60}
    )  # fmt: skip
