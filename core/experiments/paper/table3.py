"""Table 3: residuals, states, or both (paper section 6.5.1)."""

from typing import Unpack

from core.diagnosis.features import FEATURE_ROWS, Inputs
from core.experiments.paper.published import beside_paper
from core.experiments.paper.score_tables import score_result
from core.experiments.paper.trainings import SCORES, Where, cell_summary, open_bench, scored
from core.experiments.results import Progress, Result

MODES = {"paired": "baseline", "surrogate": "surrogate"}
TITLES: dict[Inputs, str] = {
    "both": "Residuals + states",
    "residuals": "Residuals only",
    "states": "States only",
}


def run(quick: bool, progress: Progress, **where: Unpack[Where]) -> Result:
    """Train what is missing and tell; raises `InputError` for bad data.

    States alone do not depend on the residual, so both of those rows are one cell: the paper's two
    differ by chance.
    """
    bench = open_bench(quick, progress, **where)
    cells = {
        (mode, inputs): (
            bench.cell(feature_mode="raw")
            if inputs == "states"
            else bench.cell(feature_mode=mode, inputs=None if inputs == "both" else "residuals")
        )
        for mode in MODES
        for inputs in FEATURE_ROWS
    }
    cards = bench.filled(cells.values(), progress)
    rows = []
    for (mode, inputs), cell in cells.items():
        card = cards[cell.key]
        row = {"scheme": f"{TITLES[inputs]} ({MODES[mode]})", **scored(card)}
        rows.append(row | {"runs": [cell_summary(card)] if card is not None else []})
    settings = {"seeds": [0], "states_only": "one cell for both rows: it sees no residual"}
    return score_result("table3", bench, beside_paper("table3", rows, SCORES), settings)
