"""``mirrortwin dataset``: the labelled flights for training."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path

from app.cli.options import add_scheduler_options, requested_scheduler
from app.cli.output import print_json, progress, writable_folder

DESCRIPTION = """\
Fly the data set: every class equally often, each flight with its mirror, split by run into
training, validation and test parts. assets/data/dataset.toml holds the settings. After an
interruption, the same command continues where it stopped.
"""
EXAMPLES = """\
examples:
  mirrortwin dataset --runs-per-class 80 --out data/lab
  mirrortwin dataset --conditions field --out data/field
  mirrortwin dataset --runs-per-class 4 --out data/small --workers 1
  mirrortwin dataset --out data/lab --scheduler tls://10.0.0.5:8786
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument(
        "--out", type=Path, required=True, metavar="DIR", help="the folder to write to"
    )
    parser.add_argument(
        "--runs-per-class", type=int, metavar="N",
        help="flights of each class, 4 or more (default: as in the settings)",
    )  # fmt: skip
    parser.add_argument(
        "--seed", type=int, metavar="N",
        help="seed of the first flight, the others follow (default: as in the settings)",
    )  # fmt: skip
    parser.add_argument(
        "--conditions", choices=("lab", "field"),
        help="lab or field (default: as in the settings)",
    )  # fmt: skip
    parser.add_argument(
        "--workers", type=int, default=2, metavar="N", help="processes that fly (default 2)"
    )
    add_scheduler_options(parser)
    parser.add_argument("--json", action="store_true", help="print what was flown as JSON")


def run(args: argparse.Namespace) -> None:
    """Fly what is missing; raises `InputError` or `StoreError`."""
    from core.checks import checked_number
    from core.dataset.generate import DatasetSpec, generate

    workers = int(checked_number("workers", args.workers, 1, 256))
    chosen = {
        "runs_per_class": args.runs_per_class,
        "first_seed": args.seed,
        "conditions": args.conditions,
    }
    spec = replace(
        DatasetSpec.load(), **{name: value for name, value in chosen.items() if value is not None}
    )
    scheduler = requested_scheduler(args)
    out = writable_folder(args.out)
    if scheduler is not None and scheduler.warning:
        print(scheduler.warning, file=sys.stderr)
    with progress(f"flying {spec.runs_per_class} pairs a class") as show:
        manifest = generate(
            spec,
            out,
            workers=workers,
            scheduler=scheduler,
            progress=lambda done, total: show(done / total),
        )
    counts = {part: len(manifest.part(part)) for part in ("train", "validation", "test")}
    if args.json:
        print_json({"out": str(out), "spec": spec.to_dict(), "runs": counts})
    else:
        print(f"{out}: " + ", ".join(f"{count} {part}" for part, count in counts.items()))
