"""Table 2: every feature mode times every classifier (paper section 6.4)."""

from typing import Any, Unpack

import numpy as np

from core.diagnosis.classifiers import CLASSIFIERS, cheapest_first
from core.diagnosis.features import FEATURE_MODES
from core.experiments.paper.published import Row, beside_paper, paper_tables
from core.experiments.paper.score_tables import score_result
from core.experiments.paper.trainings import Where, cell_summary, open_bench, scored
from core.experiments.results import Progress, Result
from core.model_card import Card

TITLES = {
    "paired": "Paired-mirror residuals",
    "surrogate": "GRU surrogate residuals",
    "raw": "Raw states",
    "differencing": "Simple differencing",
}
"""As Table 2 spells them; Table 1 says more of the surrogate."""

MEASURES = ("accuracy", "macro_f1", "per_class_f1_sd")


def run(quick: bool, progress: Progress, **where: Unpack[Where]) -> Result:
    """Train what is missing and tell; raises `InputError` for bad data."""
    bench = open_bench(quick, progress, **where)
    cells = {
        (mode, classifier): bench.cell(feature_mode=mode, classifier=classifier)
        for classifier in cheapest_first()
        for mode in FEATURE_MODES
    }
    cards = bench.filled(cells.values(), progress)
    found = {place: cards[cell.key] for place, cell in cells.items()}
    rows = [
        _row(f"{TITLES[mode]} + {CLASSIFIERS[classifier].title}", card)
        for (mode, classifier), card in found.items()
    ]
    rows.sort(key=lambda row: -(row["macro_f1"] or 0.0))
    ranges = _ranges(found)
    return score_result(
        "table2",
        bench,
        beside_paper("table2", rows, MEASURES),
        {"seeds": [0]},
        {"ranges": ranges, "paper_ranges": paper_tables()["table2_ranges"]},
        (_summary_line(ranges),),
    )


def _row(scheme: str, card: Card | None) -> dict[str, Any]:
    spread = None
    if card is not None:
        per_class = list(card["scores"]["test_windows"]["per_class_f1"].values())
        spread = float(np.std(per_class))
    row: dict[str, Any] = {"scheme": scheme, **scored(card), "per_class_f1_sd": spread}
    return row | {"runs": [cell_summary(card)] if card is not None else []}


def _ranges(found: dict[tuple[str, str], Card | None]) -> dict[str, float | None]:
    """How far macro-F1 moves with the feature mode (1D-CNN), and with the classifier (paired)."""
    modes = [scored(found[mode, "cnn"])["macro_f1"] for mode in FEATURE_MODES]
    classifiers = [scored(found["paired", name])["macro_f1"] for name in CLASSIFIERS]
    by_mode, by_classifier = _range(modes), _range(classifiers)
    ratio = by_mode / by_classifier if by_mode is not None and by_classifier else None
    return {"feature_mode": by_mode, "classifier": by_classifier, "ratio": ratio}


def _range(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return max(known) - min(known) if len(known) == len(values) else None


def _summary_line(ranges: Row) -> str:
    if ranges["ratio"] is None:
        return "feature mode against classifier: not all cells were run"
    return (
        f"feature mode moves macro-F1 by {ranges['feature_mode']:.3f}, the classifier by "
        f"{ranges['classifier']:.3f}: {ranges['ratio']:.1f} times"
    )
