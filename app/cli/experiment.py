"""``mirrortwin experiment``: a result of the paper, made again."""

import argparse
from pathlib import Path
from typing import Any

from app.cli.output import print_json, progress, writable_folder
from core.checks import checked_number
from core.errors import InputError
from core.experiments.registry import RUNNABLE

QUICK_FOLDER = Path("quick-results")

DESCRIPTION = """\
Reproduce a result of the paper from seeds. Each experiment writes NAME.json (the numbers, with
settings and code version), NAME.png and NAME.html.
"""
EXAMPLES = """\
experiments:
{experiments}

examples:
  mirrortwin experiment fig6
  mirrortwin experiment signs --quick --out /tmp/results
  mirrortwin experiment table1 --data data/lab --minutes 60
  mirrortwin experiment table2 --conditions field
""".format(experiments="\n".join(f"  {item.name:<8}{item.summary}" for item in RUNNABLE.values()))


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("name", choices=RUNNABLE, metavar="NAME", help="the experiment: see below")
    parser.add_argument(
        "--quick", action="store_true", help="less data: tests the code, not the result"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="output folder (default: models/results of this installation, with --quick "
        f"./{QUICK_FOLDER})",
    )  # fmt: skip
    parser.add_argument(
        "--logs", type=Path, metavar="DIR",
        help="realism only: the folder of real logs, CSV (default: ../shared/logs beside this "
        "installation)",
    )  # fmt: skip
    parser.add_argument(
        "--data", type=Path, metavar="DIR",
        help="table1-4: a folder that dataset wrote; flown first if missing (default: "
        "data/CONDITIONS). cross: the folder with lab/ and field/ (default: data)",
    )  # fmt: skip
    parser.add_argument(
        "--conditions", choices=("lab", "field"), help="table1-4 only: which flights (default lab)"
    )
    parser.add_argument(
        "--minutes", type=float, metavar="M",
        help="table1-4 and 6 only: start no training, and no report by a language model, after M "
        "minutes; the next call continues. 0 only writes the results so far",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the JSON file too")


def run(args: argparse.Namespace) -> None:
    """Run one experiment and write its files.

    Raises `InputError`, `FlightError`, `StoreError`, or `MirrorTwinError` where no browser can
    print the picture.
    """
    from core.experiments.results import write_result
    from core.paths import RESULTS

    given = _given(args)
    out = writable_folder(args.out or (QUICK_FOLDER if args.quick else RESULTS))
    with progress(args.name) as show:
        result = RUNNABLE[args.name].run(args.quick, show, **given)
    content = write_result(result, out)
    if args.json:
        print_json(content)
        return
    for line in result.summary:
        print(line)
    print(out / f"{result.name}.json")


def _given(args: argparse.Namespace) -> dict[str, Any]:
    """The options that only some experiments take; raises `InputError` if this one does not."""
    given: dict[str, Any] = {}
    for name in ("logs", "data", "conditions", "minutes"):
        value = getattr(args, name)
        if value is None:
            continue
        if name not in RUNNABLE[args.name].options:
            raise InputError(name, f"the experiment {args.name} takes no --{name}")
        given[name] = value
    if "minutes" in given:
        given["minutes"] = checked_number("minutes", given["minutes"], 0.0, 100_000.0)
    return given
