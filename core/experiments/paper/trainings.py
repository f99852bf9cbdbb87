"""The cells of Tables 1 to 4: one training each, kept, so that a table can be filled bit by bit.

A cell is a folder of the data set, ``cells/KEY``, with the card that the training wrote (and a
network's weights). It counts as done if its card was made by this training of this data; a
training that was cut short goes on after its last whole epoch. Tables share their cells.
"""

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from statistics import fmean, stdev
from typing import Any, TypedDict, Unpack

from core.dataset.archive import MANIFEST, Manifest, read_manifest
from core.dataset.generate import DatasetSpec, generate
from core.diagnosis.features import FEATURE_MODES
from core.diagnosis.settings import TrainingSettings
from core.diagnosis.trainer import identity_of
from core.diagnosis.training import train
from core.errors import InputError, MirrorTwinError
from core.experiments.results import Progress
from core.model_card import Card, load_model, read_card
from core.paths import MODELS
from core.residual.surrogate import Surrogate
from core.residual.surrogate_training import CHOSEN_HORIZON, SurrogateSettings, train_surrogate
from core.twin.plan import Conditions

QUICK_SPEC = DatasetSpec(
    runs_per_class=4, first_seed=1_900_000_000, duration_s=160.0, onset_s=(30.0, 40.0)
)
"""What ``--quick`` flies: enough for every class to be learnt from, validated on and tested."""

QUICK_EPOCHS = 2
FLYING = 0.3
"""The share of a table's progress that flying its data set makes up."""
QUICK_SURROGATE = SurrogateSettings(
    flights=2, held_out=1, duration_s=60.0, updates=20, batch=4, seed=0
)


@dataclass(frozen=True, slots=True)
class Cell:
    """One training: its settings, and the horizon of the surrogate where it needs one."""

    settings: TrainingSettings
    horizon: int

    @property
    def key(self) -> str:
        """The name of its folder."""
        settings = self.settings
        parts = [settings.feature_mode, settings.shown, settings.classifier, f"s{settings.seed}"]
        if self.needs_surrogate:
            parts.append(f"h{self.horizon}")
        return "-".join(parts)

    @property
    def needs_surrogate(self) -> bool:
        """Whether its residuals are predictions' errors."""
        return FEATURE_MODES[self.settings.feature_mode].residual is None


@dataclass(frozen=True, slots=True)
class Bench:
    """Where cells are trained: a whole data set and how much may be spent on it.

    ``deadline`` is the `time.monotonic` after which no new cell is begun.
    """

    data: Path
    manifest: Manifest
    quick: bool
    deadline: float

    @property
    def conditions(self) -> Conditions:
        """Lab or field, as the data set was flown."""
        conditions: Conditions = self.manifest.spec["conditions"]
        return conditions

    @property
    def horizon(self) -> int:
        """That of the surrogate that ships for these conditions."""
        return CHOSEN_HORIZON[self.conditions]

    def cell(self, horizon: int | None = None, **chosen: Any) -> Cell:
        """A training with `TrainingSettings` ``chosen``; quick, it only proves the path."""
        settings = TrainingSettings(**chosen)
        if self.quick:
            settings = replace(settings, epochs=QUICK_EPOCHS, draws=1)
        return Cell(settings, self.horizon if horizon is None else horizon)

    def filled(self, cells: Iterable[Cell], progress: Progress) -> dict[str, Card | None]:
        """The card of each cell by key: kept, made now, or None where time did not allow it."""
        wanted = {cell.key: cell for cell in cells}
        cards: dict[str, Card | None] = {}
        for done, (key, cell) in enumerate(wanted.items()):
            progress(FLYING + (1.0 - FLYING) * done / len(wanted))
            cards[key] = self._card(cell)
        progress(1.0)
        return cards

    def surrogate(self, horizon: int) -> Surrogate | None:
        """The surrogate of that horizon: the shipped one, or trained here; None if out of time."""
        settings = replace(
            QUICK_SURROGATE if self.quick else SurrogateSettings(),
            conditions=self.conditions,
            horizon=horizon,
        )
        name = f"gru-{self.conditions}"
        folder = MODELS
        if self.quick or horizon != self.horizon or not (MODELS / f"{name}.json").exists():
            folder = self.data / "surrogates" / f"h{horizon}"
            if not (folder / f"{name}.json").exists():
                if self._is_late():
                    return None
                train_surrogate(folder, settings, work_dir=folder)
        return Surrogate.from_card(*load_model(folder, name))

    def surrogate_card(self, horizon: int) -> Card | None:
        """The card of that surrogate, if it has been trained."""
        folder = self.data / "surrogates" / f"h{horizon}"
        name = f"gru-{self.conditions}"
        for place in (folder, *([MODELS] if horizon == self.horizon else [])):
            if (place / f"{name}.json").exists():
                return read_card(place, name)
        return None

    def _is_late(self) -> bool:
        return time.monotonic() >= self.deadline

    def _card(self, cell: Cell) -> Card | None:
        surrogate = self.surrogate(cell.horizon) if cell.needs_surrogate else None
        if cell.needs_surrogate and surrogate is None:
            return None
        folder = self.data / "cells" / cell.key
        fingerprint = surrogate.fingerprint if surrogate else ""
        identity = identity_of(cell.settings, self.manifest, fingerprint)
        kept = _kept(folder, identity)
        if kept is not None or self._is_late():
            return kept
        return train(
            self.data, folder, cell.settings,
            surrogate=surrogate, work_dir=folder, whole_runs=False,
        )  # fmt: skip


def _kept(folder: Path, identity: str) -> Card | None:
    for path in folder.glob("*.json"):
        try:
            card = read_card(folder, path.stem)
        except MirrorTwinError:
            continue
        if card.get("identity") == identity:
            return card
    return None


class Where(TypedDict, total=False):
    """What a person may choose for a table: the data set, its conditions, how long to go on."""

    data: Path
    conditions: Conditions
    minutes: float


def open_bench(quick: bool, progress: Progress, **where: Unpack[Where]) -> Bench:
    """The data set in ``data``: by default ``data/CONDITIONS``, with ``quick`` a small one.

    It is flown first where it is not whole, by `FLYING` of the progress. After ``minutes`` no new
    cell is begun. Raises `InputError` if the data set is of other conditions.
    """
    minutes = where.get("minutes", math.inf)
    wanted = where.get("conditions", "lab")
    folder = where.get("data", Path("data") / (f"quick-{wanted}" if quick else wanted))
    if not (folder / MANIFEST).exists():
        spec = replace(QUICK_SPEC if quick else DatasetSpec.load(), conditions=wanted)
        generate(spec, folder, progress=lambda done, total: progress(FLYING * done / total))
    manifest = read_manifest(folder)
    if where.get("conditions", manifest.spec["conditions"]) != manifest.spec["conditions"]:
        raise InputError("conditions", f"{folder} was flown in {manifest.spec['conditions']}")
    return Bench(folder, manifest, quick, time.monotonic() + 60.0 * minutes)


SCORES = ("accuracy", "macro_precision", "macro_recall", "macro_f1")


def scored(card: Card | None) -> dict[str, Any]:
    """The test scores of a cell for its row; null where it was not run."""
    if card is None:
        return dict.fromkeys(SCORES)
    found = card["scores"]["test_windows"]
    return {name: found[name] for name in SCORES}


def over_seeds(cards: Iterable[Card | None]) -> dict[str, Any]:
    """Mean and standard deviation of the scores over those seeds that were run, and each run."""
    done = [card for card in cards if card is not None]
    scores = [scored(card) for card in done]
    row: dict[str, Any] = {}
    for name in SCORES:
        values = [each[name] for each in scores]
        row[name] = fmean(values) if values else None
        row[f"{name}_sd"] = stdev(values) if len(values) > 1 else None
    return row | {"seeds_run": len(done), "runs": [told(card) for card in done]}


def told(card: Card) -> dict[str, Any]:
    """What is kept of a cell in a result: its seed, scores, confusions, cost and origin."""
    training, found = card["training"], card["scores"]["test_windows"]
    return {
        "seed": training["settings"]["seed"],
        **{name: found[name] for name in SCORES},
        "validation_macro_f1": card["scores"]["validation_windows"]["macro_f1"],
        "test_windows": found["n"],
        "per_class_f1": found["per_class_f1"],
        "confusion": found["confusion"],
        "confused": found["confused"],
        "mistakes": _columns(found["mistakes"]),
        "epochs_run": training.get("epochs_run"),
        "training_s": training["seconds"],
        "device": training["device"],
        "settings": training["settings"],
        "code": card["code"],
        **({"surrogate": card["surrogate"]} if "surrogate" in card else {}),
    }


def _columns(rows: Sequence[Mapping[str, Any]]) -> dict[str, list[Any]]:
    """Rows of one form as a list for each of their fields: a tenth of the lines in a file."""
    return {name: [row[name] for row in rows] for name in rows[0]} if rows else {}
