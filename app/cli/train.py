"""``mirrortwin train``: a diagnosis network from a data set."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.output import note, print_json, writable_folder
from core.paths import MODELS

if TYPE_CHECKING:
    from core.diagnosis.settings import Epoch

DESCRIPTION = """\
Train the paper's convolutional network on a data set, score it once on the test part, and save its
weights and its card (classes, seeds, settings, scores). Interrupted, the same command goes on after
the last whole epoch and ends with the same weights.
"""
EXAMPLES = """\
examples:
  mirrortwin train --data data/lab --out models/
  mirrortwin train --data data/small --out /tmp/models --epochs 3
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument(
        "--data", type=Path, required=True, metavar="DIR", help="a folder that dataset wrote"
    )
    parser.add_argument(
        "--out", type=Path, default=MODELS, metavar="DIR",
        help="where weights and card go (default: the models/ of this installation)",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="default 0")
    parser.add_argument(
        "--epochs", type=int, metavar="N", help="at most this many passes over the training data"
    )
    parser.add_argument("--json", action="store_true", help="print the card as JSON")


def run(args: argparse.Namespace) -> None:
    """Train and save; raises `InputError` or `StoreError`."""
    from core.diagnosis.settings import TrainingSettings
    from core.diagnosis.training import train

    settings = TrainingSettings(seed=args.seed)
    if args.epochs is not None:
        settings = TrainingSettings(seed=args.seed, epochs=args.epochs)
    card = train(args.data, writable_folder(args.out), settings, progress=_tell)
    if args.json:
        print_json(card)
        return
    print(f"{card['name']} in {args.out}")
    for part, scores in card["scores"].items():
        print(f"  {part}: macro-F1 {scores['macro_f1']:.4f}")


def _tell(epoch: "Epoch") -> None:
    note(
        f"epoch {epoch.index}/{epoch.of}  loss {epoch.train_loss:.4f}  "
        f"validation macro-F1 {epoch.validation_macro_f1:.4f} (best {epoch.best_macro_f1:.4f})  "
        f"rate {epoch.learning_rate:.1e}  {epoch.seconds:.1f} s"
    )
