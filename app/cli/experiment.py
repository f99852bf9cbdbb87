"""``mirrortwin experiment``: a result of the paper, made again."""

import argparse
from importlib import import_module
from pathlib import Path

from app.cli.output import print_json, progress, writable_folder
from core.errors import InputError

QUICK_FOLDER = Path("quick-results")

EXPERIMENTS: dict[str, str] = {
    "fig6": "paths in 3D and from the side, five faults and nominal",
    "fig7": "six key channels, five faults and nominal",
    "realism": "our field flights beside real G1000 logs (--logs; some ten minutes)",
    "signs": "does every fault move every channel the way engineers say?",
    "speed": "what a flight costs, in bare JSBSim loops (some minutes; on a quiet machine)",
    "table6": "how good are reports by the template and by a language model, raw and grounded?",
}
"""Each is a module of `core.experiments` with ``run(quick, progress)``."""

DESCRIPTION = """\
Make a result of the paper again, from seeds. Each writes NAME.json (the figures, with settings and
code version), NAME.png and NAME.html.
"""
EXAMPLES = """\
experiments:
{experiments}

examples:
  mirrortwin experiment fig6
  mirrortwin experiment signs --quick --out /tmp/results
""".format(experiments="\n".join(f"  {name:<8}{text}" for name, text in EXPERIMENTS.items()))


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("name", choices=EXPERIMENTS, metavar="NAME", help="which: see below")
    parser.add_argument(
        "--quick", action="store_true", help="less data: proves the path, not the result"
    )
    parser.add_argument(
        "--out", type=Path, metavar="DIR",
        help="where the files go (default: models/results of this installation, with --quick "
        f"./{QUICK_FOLDER})",
    )  # fmt: skip
    parser.add_argument(
        "--logs", type=Path, metavar="DIR",
        help="realism only: the folder of real logs, CSV (default: ../shared/logs beside this "
        "installation)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print the JSON file too")


def run(args: argparse.Namespace) -> None:
    """Run one experiment and write its files.

    Raises `InputError`, `FlightError`, `StoreError`, or `MirrorTwinError` where no browser can
    print the picture.
    """
    from core.experiments.results import RESULTS, write_result

    given = {} if args.logs is None else {"logs": args.logs}
    if given and args.name != "realism":
        raise InputError("logs", "only the experiment realism reads logs")
    out = writable_folder(args.out or (QUICK_FOLDER if args.quick else RESULTS))
    with progress(args.name) as show:
        result = import_module(f"core.experiments.{args.name}").run(args.quick, show, **given)
    content = write_result(result, out)
    if args.json:
        print_json(content)
        return
    for line in result.summary:
        print(line)
    print(out / f"{args.name}.json")
