"""Table 1: the paper's 1D-CNN on four feature modes, three seeds each (paper section 6.3)."""

from statistics import fmean, stdev
from typing import Any, Unpack

from core.diagnosis.card import Card
from core.diagnosis.features import FEATURE_MODES
from core.experiments.cells import SCORES, Cell, Where, open_bench, scored, told
from core.experiments.paper import beside_paper
from core.experiments.results import Progress, Result
from core.experiments.score_tables import score_result

SEEDS = (0, 1, 2)


def run(quick: bool, progress: Progress, **where: Unpack[Where]) -> Result:
    """Train what is missing and tell; raises `InputError` for bad data."""
    bench = open_bench(quick, progress, **where)
    seeds = SEEDS[:1] if quick else SEEDS
    cells = {
        (mode, seed): Cell(bench.settings(feature_mode=mode, seed=seed))
        for seed in seeds
        for mode in FEATURE_MODES
    }
    cards = bench.filled(cells.values(), progress)
    rows = [
        _row(title.title, [cards[cells[mode, seed].key] for seed in seeds])
        for mode, title in FEATURE_MODES.items()
    ]
    return score_result(
        "table1", bench, beside_paper("table1", rows, SCORES), {"seeds": list(seeds)}
    )


def _row(scheme: str, cards: list[Card | None]) -> dict[str, Any]:
    """Mean and standard deviation over the seeds that were run."""
    done = [card for card in cards if card is not None]
    scores = [scored(card) for card in done]
    row: dict[str, Any] = {"scheme": scheme}
    for name in SCORES:
        values = [each[name] for each in scores]
        row[name] = fmean(values) if values else None
        row[f"{name}_sd"] = stdev(values) if len(values) > 1 else None
    return row | {"seeds_run": len(done), "runs": [told(card) for card in done]}
