"""``mirrortwin diagnose``: name the fault behind two logged flights."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.output import print_json, stdout
from core.errors import InputError

if TYPE_CHECKING:
    from core.diagnosis.diagnosis import Diagnosis
    from core.twin.trajectory import Pair

DESCRIPTION = """\
Diagnose a folder that `mirrortwin simulate` wrote. Only faulted.parquet and mirror.parquet are
read: what was injected (run.json) is not.
"""
EXAMPLES = """\
examples:
  mirrortwin diagnose flight
  mirrortwin diagnose flight --json

the JSON holds "top" (a fault id), "probabilities" (id: 0 to 1, all 20) and "evidence" (channels
that left their mirror: when, how far, which way).
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("folder", type=Path, metavar="DIR", help="a folder written by simulate")
    parser.add_argument("--json", action="store_true", help="print the diagnosis as JSON")


def run(args: argparse.Namespace) -> None:
    """Print the diagnosis; raises `InputError`, `StoreError` or `MirrorTwinError`."""
    pair = read_pair(args.folder)
    from core.diagnosis.predict import load_diagnoser

    diagnosis = load_diagnoser().diagnose(pair)
    if args.json:
        print_json(diagnosis.to_dict())
    else:
        _print_tables(diagnosis)


def read_pair(folder: Path) -> "Pair":
    """The pair in ``folder``; raises `InputError` if it is not there or its halves differ."""
    if not folder.is_dir():
        raise InputError("DIR", f"there is no folder {folder}")
    from core.jobs.store import read_trajectory
    from core.twin.trajectory import Pair

    paths = [folder / name for name in ("faulted.parquet", "mirror.parquet")]
    for path in paths:
        if not path.is_file():
            raise InputError(
                "DIR", f"{folder} holds no {path.name}; `mirrortwin simulate` writes it"
            )
    pair = Pair(*(read_trajectory(path) for path in paths))
    if len(pair.faulted) != len(pair.mirror):
        raise InputError(
            "DIR",
            f"faulted.parquet has {len(pair.faulted)} samples and mirror.parquet "
            f"{len(pair.mirror)}: they are not of one flight",
        )
    return pair


def _print_tables(diagnosis: "Diagnosis") -> None:
    from rich.table import Table

    ranked = Table("diagnosis", "probability", box=None)
    for mode, probability in diagnosis.ranked(3):
        ranked.add_row(mode, f"{probability:.1%}")
    stdout().print(ranked)
    if not diagnosis.evidence:
        stdout().print("\nNo channel left its mirror.")
        return
    found = Table("channel", "from", "to", "mean residual", "in sigma", box=None)
    for item in diagnosis.evidence:
        found.add_row(
            item.channel,
            f"{item.start_s:.0f} s",
            f"{item.end_s:.0f} s",
            f"{item.value:+.3g} {item.unit}",
            f"{item.sigma:+.1f}",
        )
    stdout().print()
    stdout().print(found)
