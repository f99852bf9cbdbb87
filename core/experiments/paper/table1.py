"""Table 1: the paper's 1D-CNN on four feature modes, three seeds each (paper section 6.3)."""

from typing import Unpack

from core.diagnosis.features import FEATURE_MODES
from core.experiments.paper.published import beside_paper
from core.experiments.paper.score_tables import score_result
from core.experiments.paper.trainings import SCORES, Where, open_bench, over_seeds
from core.experiments.results import Progress, Result

SEEDS = (0, 1, 2)


def run(quick: bool, progress: Progress, **where: Unpack[Where]) -> Result:
    """Train what is missing and tell; raises `InputError` for bad data."""
    bench = open_bench(quick, progress, **where)
    seeds = SEEDS[:1] if quick else SEEDS
    cells = {
        (mode, seed): bench.cell(feature_mode=mode, seed=seed)
        for seed in seeds
        for mode in FEATURE_MODES
    }
    cards = bench.filled(cells.values(), progress)
    rows = [
        {"scheme": title.title, **over_seeds([cards[cells[mode, seed].key] for seed in seeds])}
        for mode, title in FEATURE_MODES.items()
    ]
    return score_result(
        "table1", bench, beside_paper("table1", rows, SCORES), {"seeds": list(seeds)}
    )
