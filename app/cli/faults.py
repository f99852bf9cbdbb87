"""``mirrortwin faults``: the FMEA catalogue."""

import argparse
from typing import TYPE_CHECKING, Any

from app.cli.output import print_json, stdout

if TYPE_CHECKING:
    from core.fmea.catalogue import Mode

DESCRIPTION = (
    "List the engine faults and nominal: what they affect, how they grow, their FMEA ratings."
)
EXAMPLES = """\
examples:
  mirrortwin faults
  mirrortwin faults --json | python -m json.tool
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("--json", action="store_true", help="print a JSON list of the modes")


def run(args: argparse.Namespace) -> None:
    """Print the catalogue."""
    from core.fmea.catalogue import catalogue

    modes = catalogue().values()
    if args.json:
        print_json([_described(mode) for mode in modes])
        return
    from rich.table import Table

    table = Table("id", "name", "subsystem", "grows by", "S", "O", "D", box=None)
    for mode in modes:
        ratings = (mode.severity_rating, mode.occurrence, mode.detection)
        table.add_row(mode.id, mode.name, mode.subsystem, mode.law, *map(str, ratings))
    stdout().print(table)
    stdout().print("S, O, D: FMEA ratings of severity, occurrence and detection, 1 to 10.")


def _described(mode: "Mode") -> dict[str, Any]:
    return {
        "id": mode.id,
        "name": mode.name,
        "subsystem": mode.subsystem,
        "law": mode.law,
        "cylinder": None if mode.whole_engine else mode.cylinder,
        "severity_rating": mode.severity_rating,
        "occurrence": mode.occurrence,
        "detection": mode.detection,
        "rpn": mode.rpn,
    }
