"""``mirrortwin import``: runs that were exported elsewhere."""

import argparse
from pathlib import Path

from app.cli.output import print_json

DESCRIPTION = """\
Import the runs of a zip written by `mirrortwin export` or the page Runs into the store, under their
own names. Checksums and contents are checked first; if anything is wrong, nothing is imported.
"""
EXAMPLES = """\
examples:
  mirrortwin import run.zip
  mirrortwin import run.zip --store ~/flights --json
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("file", type=Path, metavar="FILE", help="the zip file")
    parser.add_argument(
        "--store", type=Path, metavar="DIR",
        help="where runs are kept (default: $MIRRORTWIN_HOME, else .mirrortwin)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the imported runs as JSON")


def run(args: argparse.Namespace) -> None:
    """Import the runs; raises `InputError` or `StoreError`."""
    from app.archives import import_runs
    from app.kit.words import run_title
    from core.store.store import RunStore, default_root

    records = import_runs(RunStore(args.store or default_root()), args.file)
    if args.json:
        print_json([record.to_dict() for record in records])
    else:
        for record in records:
            print(f"{record.id}: {run_title(record)}")
