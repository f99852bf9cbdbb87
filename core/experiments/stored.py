"""Results that lie in ``models/results``, read without flying or training anything.

A result may be missing, half done or damaged; each of these is said where it is shown.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from core.errors import StoreError
from core.files import read_json
from core.paths import MODELS, RESULTS

ONSET_KNOWN = "with the onset known"
"""What a score in field means whose windows were placed by the truth, which no flight tells."""

_BY_TRUTH = "first shows"
"""In ``scored_on``: the test windows follow the moment at which the fault first shows."""


@dataclass(frozen=True, slots=True)
class StoredResult:
    """A result by name: its ``content``, or None and the ``problem`` with it.

    ``problem`` is empty where the file simply does not exist yet. ``picture`` and ``page`` say
    whether the PNG and the interactive HTML lie beside it.
    """

    name: str
    content: Mapping[str, Any] | None
    problem: str = ""
    picture: bool = False
    page: bool = False


def load_result(name: str, folder: Path = RESULTS) -> StoredResult:
    """The result of that name."""
    path = folder / f"{name}.json"
    if not path.is_file():
        return StoredResult(name, None)
    try:
        content = read_json(path)
    except StoreError as error:
        return StoredResult(name, None, str(error))
    if not isinstance(content, dict):
        return StoredResult(name, None, f"{path} is not a result")
    return StoredResult(
        name,
        content,
        picture=(folder / f"{name}.png").is_file(),
        page=(folder / f"{name}.html").is_file(),
    )


def model_cards(folder: Path = MODELS) -> list[dict[str, Any]]:
    """The cards of the classifiers in ``folder``, lab's first; damaged ones are left out."""
    cards = []
    for path in sorted(folder.glob("*.json")):
        try:
            card = read_json(path)
        except StoreError:
            continue
        if "test_windows" in card.get("scores", {}):
            cards.append(card)
    return sorted(cards, key=lambda card: (card.get("conditions") != "lab", card["name"]))


def with_onset_known(content: Mapping[str, Any]) -> str:
    """`ONSET_KNOWN` after a comma, for a field score in windows that the truth placed; else "".

    In lab the two flights part visibly at the onset, so that the app places the same windows. A
    result, or a model's card, says how it was scored in ``scored_on``; one that does not was scored
    in such windows.
    """
    settings = content.get("settings", {})
    conditions = content.get("conditions") or settings.get("conditions")
    scored_on = content.get("scored_on") or settings.get("scored_on") or _BY_TRUTH
    return f", {ONSET_KNOWN}" if conditions == "field" and _BY_TRUTH in scored_on else ""
