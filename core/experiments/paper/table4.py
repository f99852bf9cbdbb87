"""Table 4: how far ahead the surrogate learns to predict (paper section 6.5.2)."""

from statistics import fmean
from typing import Any, Unpack

from core.experiments.paper.published import beside_paper
from core.experiments.paper.score_tables import score_result
from core.experiments.paper.trainings import Where, open_bench, over_seeds
from core.experiments.results import Progress, Result
from core.model_card import Card

HORIZONS = {1: "1", 3: "3", 5: "5", 10: "10 (default)"}
"""As the paper spells them."""

SEEDS = (0, 1, 2)
MEASURES = ("macro_f1", "mae", "rmse")


def run(quick: bool, progress: Progress, **where: Unpack[Where]) -> Result:
    """Train what is missing and tell; raises `InputError` for bad data."""
    bench = open_bench(quick, progress, **where)
    seeds = SEEDS[:1] if quick else SEEDS
    cells = {
        (horizon, seed): bench.cell(horizon, feature_mode="surrogate", seed=seed)
        for seed in seeds
        for horizon in HORIZONS
    }
    cards = bench.filled(cells.values(), progress)
    rows: list[dict[str, Any]] = []
    for horizon, scheme in HORIZONS.items():
        of_horizon = [cards[cells[horizon, seed].key] for seed in seeds]
        surrogate = bench.surrogate_card(horizon)
        errors = surrogate["scores"]["held_out_flights"] if surrogate else {}
        rows.append(
            {
                "scheme": scheme,
                **{name: errors.get(name) for name in ("mae", "rmse", "mae_in_channel_sd")},
                **over_seeds(of_horizon),
                "validation_macro_f1": _on_validation(of_horizon),
            }
        )
    settings = {
        "seeds": list(seeds),
        "errors": "one step ahead on held-out healthy flights, averaged over the 23 channels in "
        "their own units",
    }
    chosen = _chosen(rows)
    return score_result(
        "table4", bench, beside_paper("table4", rows, MEASURES), settings,
        findings={"chosen_on_validation": chosen},
        summary=(f"chosen on validation flights: H = {chosen}",) if chosen else (),
    )  # fmt: skip


def _on_validation(cards: list[Card | None]) -> float | None:
    """Mean macro-F1 on the validation part of the training split; None if no cell was run."""
    scores = [card["scores"]["validation_windows"]["macro_f1"] for card in cards if card]
    return fmean(scores) if scores else None


def _chosen(rows: list[dict[str, Any]]) -> str | None:
    """The horizon that is best on validation flights, where test scores have no say.

    None where not all horizons have as many seeds yet.
    """
    if len({row["seeds_run"] for row in rows}) > 1 or not rows[0]["seeds_run"]:
        return None
    best = max(rows, key=lambda row: float(row["validation_macro_f1"]))
    return str(best["scheme"])
