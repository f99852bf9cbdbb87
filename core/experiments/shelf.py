"""Results that lie in ``models/results``, read without flying or training anything.

A result may be missing, half done or damaged: whoever shows one has to be able to say so.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from core.errors import StoreError
from core.jobs.files import read_json
from core.paths import MODELS

SHELF = MODELS / "results"


@dataclass(frozen=True, slots=True)
class Shelved:
    """A result by name: its ``content``, or None and the ``problem`` with it.

    ``problem`` is empty where the file simply does not exist yet. ``picture`` and ``page`` say
    whether the PNG and the interactive HTML lie beside it.
    """

    name: str
    content: Mapping[str, Any] | None
    problem: str = ""
    picture: bool = False
    page: bool = False


def take(name: str, folder: Path = SHELF) -> Shelved:
    """The result of that name."""
    path = folder / f"{name}.json"
    if not path.is_file():
        return Shelved(name, None)
    try:
        content = read_json(path)
    except StoreError as error:
        return Shelved(name, None, str(error))
    if not isinstance(content, dict):
        return Shelved(name, None, f"{path} is not a result")
    return Shelved(
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
