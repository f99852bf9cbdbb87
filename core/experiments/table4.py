"""Table 4: how far ahead the surrogate learns to predict (paper section 6.5.2)."""

from typing import Any, Unpack

from core.experiments.cells import DEFAULT_HORIZON, Cell, Where, open_bench, scored, told
from core.experiments.paper import beside_paper
from core.experiments.results import Progress, Result
from core.experiments.score_tables import score_result

HORIZONS = (DEFAULT_HORIZON, 1, 3, 5)
"""The default first: its cell is that of Tables 1 and 2."""

MEASURES = ("macro_f1", "mae", "rmse")


def run(quick: bool, progress: Progress, **where: Unpack[Where]) -> Result:
    """Train what is missing and tell; raises `InputError` for bad data."""
    bench = open_bench(quick, progress, **where)
    cells = {
        horizon: Cell(bench.settings(feature_mode="surrogate"), horizon) for horizon in HORIZONS
    }
    cards = bench.filled(cells.values(), progress)
    rows = []
    for horizon in sorted(cells):
        card = cards[cells[horizon].key]
        surrogate = bench.surrogate_card(horizon)
        errors = surrogate["scores"]["held_out_flights"] if surrogate else {}
        row: dict[str, Any] = {
            "scheme": f"{horizon} (default)" if horizon == DEFAULT_HORIZON else str(horizon),
            **scored(card),
            **{name: errors.get(name) for name in ("mae", "rmse", "mae_in_channel_sd")},
        }
        rows.append(row | {"runs": [told(card)] if card is not None else []})
    settings = {
        "seeds": [0],
        "errors": "one step ahead on held-out healthy flights, averaged over the 23 channels in "
        "their own units",
    }
    return score_result("table4", bench, beside_paper("table4", rows, MEASURES), settings)
