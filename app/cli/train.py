"""``mirrortwin train``: a classifier from a data set, or the surrogate from healthy flights."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from app.cli.output import note, print_json, progress, writable_folder
from core.diagnosis.classifiers import CLASSIFIERS
from core.errors import InputError
from core.paths import MODELS

if TYPE_CHECKING:
    from core.diagnosis.settings import Epoch
    from core.residual.surrogate_training import Step

DESCRIPTION = """\
Train a classifier (by default the paper's convolutional network) on a data set, score it once on
the test part, and save its weights and its card (classes, seeds, settings, scores, calibration).
With --surrogate, train the network that predicts healthy flights instead; it flies its own data.
After an interruption, the same command continues where it stopped, to the same weights.
"""
EXAMPLES = """\
examples:
  mirrortwin train --data data/lab --out models/
  mirrortwin train --surrogate --out models/
  mirrortwin train --healthy --out models/
  mirrortwin train --data data/lab --residual surrogate --out models/
  mirrortwin train --data data/small --out /tmp/models --classifier resnet --epochs 3
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    unkept = [each.id for each in CLASSIFIERS.values() if not each.keeps_weights]
    parser.add_argument("--data", type=Path, metavar="DIR", help="a folder that dataset wrote")
    parser.add_argument(
        "--surrogate", action="store_true", help="train the surrogate; needs no data set"
    )
    parser.add_argument(
        "--healthy", action="store_true",
        help="describe the spread of residuals of healthy field flights; needs no data set",
    )  # fmt: skip
    parser.add_argument(
        "--conditions", choices=("lab", "field"), default="lab",
        help="with --surrogate: conditions of its training flights (default lab)",
    )  # fmt: skip
    parser.add_argument(
        "--horizon", type=int, metavar="H",
        help="with --surrogate: predict 1 to H steps ahead (default: as the shipped model)",
    )  # fmt: skip
    parser.add_argument(
        "--out", type=Path, default=MODELS, metavar="DIR",
        help="folder for weights and card, and of the surrogate to use (default: models/ of this "
        "installation)",
    )  # fmt: skip
    parser.add_argument(
        "--residual", choices=("paired", "surrogate", "raw", "differencing"), default="paired",
        help="how the features are formed (default paired)",
    )  # fmt: skip
    parser.add_argument(
        "--classifier", choices=tuple(CLASSIFIERS), default="cnn",
        help=f"default cnn; of {' and '.join(unkept)} only the card is kept",
    )  # fmt: skip
    parser.add_argument(
        "--inputs", choices=("both", "residuals", "states"),
        help="the input channels (default: as the shipped model)",
    )  # fmt: skip
    parser.add_argument("--seed", type=int, default=0, metavar="N", help="random seed (default 0)")
    parser.add_argument(
        "--epochs", type=int, metavar="N", help="at most this many passes over the training data"
    )
    parser.add_argument("--json", action="store_true", help="print the card as JSON")


def run(args: argparse.Namespace) -> None:
    """Train and save; raises `InputError` or `StoreError`."""
    if sum((args.surrogate, args.healthy, args.data is not None)) != 1:
        raise InputError(
            "data", "name a data set with --data, or train the --surrogate, or --healthy"
        )
    out = writable_folder(args.out)
    if args.healthy:
        _healthy(args, out)
        return
    card = _surrogate(args, out) if args.surrogate else _classifier(args, out)
    if args.json:
        print_json(card)
        return
    from core.experiments.stored import with_onset_known

    print(f"{card['name']} in {args.out}")
    for part, scores in card["scores"].items():
        if "macro_f1" in scores:
            print(f"  {part}: macro-F1 {scores['macro_f1']:.4f}{with_onset_known(card)}")
        else:
            print(f"  {part}: mean absolute error one step ahead {scores['mae']:.3f}")


def _healthy(args: argparse.Namespace, out: Path) -> None:
    from core.experiments.models.healthy import make_healthy
    from core.residual.healthy import NAME

    with progress("healthy field flights") as show:
        healthy = make_healthy(out, show)
    if args.json:
        print_json(healthy.to_dict())
    else:
        print(f"{NAME} in {args.out}")


def _classifier(args: argparse.Namespace, out: Path) -> dict[str, Any]:
    from core.dataset.archive import read_manifest
    from core.diagnosis.predict import load_surrogate
    from core.diagnosis.settings import CHOSEN_INPUTS, TrainingSettings
    from core.diagnosis.training import train

    conditions = read_manifest(args.data).spec["conditions"]
    chosen = {} if args.epochs is None else {"epochs": args.epochs}
    settings = TrainingSettings(
        classifier=args.classifier,
        feature_mode=args.residual,
        inputs=args.inputs or CHOSEN_INPUTS.get((args.residual, conditions)),
        seed=args.seed,
        **chosen,
    )
    surrogate = load_surrogate(conditions, out) if args.residual == "surrogate" else None
    return train(args.data, out, settings, surrogate=surrogate, progress=_print_epoch)


def _surrogate(args: argparse.Namespace, out: Path) -> dict[str, Any]:
    from core.residual.surrogate_training import CHOSEN_HORIZON, SurrogateSettings, train_surrogate

    horizon = CHOSEN_HORIZON[args.conditions] if args.horizon is None else args.horizon
    settings = SurrogateSettings(conditions=args.conditions, horizon=horizon, seed=args.seed)

    def print_step(step: "Step") -> None:
        note(f"update {step.done}/{step.of}  loss {step.loss:.4f}")

    work = Path("data") / f"surrogate-{args.conditions}"
    return train_surrogate(out, settings, work_dir=work, progress=print_step)


def _print_epoch(epoch: "Epoch") -> None:
    note(
        f"epoch {epoch.index}/{epoch.of}  loss {epoch.train_loss:.4f}  "
        f"validation macro-F1 {epoch.validation_macro_f1:.4f} (best {epoch.best_macro_f1:.4f})  "
        f"rate {epoch.learning_rate:.1e}  {epoch.seconds:.1f} s"
    )
