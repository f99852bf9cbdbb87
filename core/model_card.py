"""A trained model on disk: weights as safetensors beside a card that people can read.

The card (JSON) holds everything else that a prediction needs and everything that one should know
before believing it: data, split, normalisation, architecture, training, scores on the test split.
"""

import hashlib
import json
from pathlib import Path
from typing import Any

from safetensors import SafetensorError
from safetensors.torch import load, save
from torch import Tensor

from core.errors import MirrorTwinError
from core.files import readable_json, whole_file

CARD_FORMAT = 1

Card = dict[str, Any]


def save_model(models: Path, card: Card, weights: dict[str, Tensor]) -> Card:
    """Write ``NAME.safetensors`` and ``NAME.json``, ``NAME`` being ``card["name"]``.

    Returns the card with its format number and the checksum of the weights added. Each file is
    written whole or not at all. Raises `StoreError` if the disk will not take it.
    """
    models.mkdir(parents=True, exist_ok=True)
    content = save({name: tensor.contiguous() for name, tensor in weights.items()})
    card = {"format": CARD_FORMAT, **card, "weights_sha256": hashlib.sha256(content).hexdigest()}
    with whole_file(models / f"{card['name']}.safetensors") as temporary:
        temporary.write_bytes(content)
    _write_card(models, card)
    return card


def save_card(models: Path, card: Card) -> Card:
    """Write the card alone, for a classifier whose weights are not kept."""
    models.mkdir(parents=True, exist_ok=True)
    card = {"format": CARD_FORMAT, **card, "weights_sha256": None}
    _write_card(models, card)
    return card


def _write_card(models: Path, card: Card) -> None:
    with whole_file(models / f"{card['name']}.json") as temporary:
        temporary.write_text(readable_json(card), encoding="utf-8")


def read_card(models: Path, name: str) -> Card:
    """The card alone; `MirrorTwinError` says what is missing or broken."""
    try:
        card: Card = json.loads((models / f"{name}.json").read_text(encoding="utf-8"))
    except FileNotFoundError as error:
        raise _missing(name, error) from None
    except (OSError, ValueError) as error:
        raise MirrorTwinError(f"model {name} cannot be read: {error}") from None
    found = card.get("format") if isinstance(card, dict) else None
    if found != CARD_FORMAT:
        raise MirrorTwinError(f"model {name}: card format {found} is not known")
    return card


def _missing(name: str, error: FileNotFoundError) -> MirrorTwinError:
    return MirrorTwinError(
        f"model {name}: {error.filename} is missing; train it with `mirrortwin train`"
    )


def load_model(models: Path, name: str) -> tuple[Card, dict[str, Tensor]]:
    """The card and the weights of a model; `MirrorTwinError` says what is missing or broken."""
    try:
        content = (models / f"{name}.safetensors").read_bytes()
    except FileNotFoundError as error:
        raise _missing(name, error) from None
    except OSError as error:
        raise MirrorTwinError(f"model {name} cannot be read: {error}") from None
    card = read_card(models, name)
    if card.get("weights_sha256") != hashlib.sha256(content).hexdigest():
        raise MirrorTwinError(f"model {name}: the weights are not those that its card describes")
    try:
        return card, load(content)
    except SafetensorError as error:
        raise MirrorTwinError(f"model {name}: the weights are damaged: {error}") from None
