"""``mirrortwin export``: a stored run as a file to take along."""

import argparse
from pathlib import Path

from app.cli.output import print_json
from core.errors import InputError

DESCRIPTION = """\
Write a finished run of the store to a file: everything, as a zip that `mirrortwin import` and the
page Runs take in again; one of its flights as a Garmin G1000 log; or its Rerun recording.
"""
EXAMPLES = """\
examples:
  mirrortwin export 20261123T061500-k3x9q2wz --out run.zip
  mirrortwin export 20261123T061500-k3x9q2wz --format csv --side mirror --out mirror.csv
  mirrortwin export 20261123T061500-k3x9q2wz --format rrd --out run.rrd
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("name", metavar="RUN", help="the run's name, as in its address")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="the file to write")
    parser.add_argument("--format", choices=("zip", "csv", "rrd"), default="zip")
    parser.add_argument(
        "--side", choices=("faulted", "mirror"), default="faulted", help="which flight, for csv"
    )
    parser.add_argument(
        "--rate", type=int, default=1, metavar="HZ", help="rows a second, for csv (default 1)"
    )
    parser.add_argument(
        "--store", type=Path, metavar="DIR",
        help="where runs are kept (default: $MIRRORTWIN_HOME, else .mirrortwin)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print what was written as JSON")


def run(args: argparse.Namespace) -> None:
    """Write the file; raises `InputError` or `StoreError`."""
    from core.jobs.files import whole_file
    from core.jobs.g1000_file import g1000_csv
    from core.jobs.store import RunStore, default_root

    if not args.out.parent.is_dir():
        raise InputError("out", f"there is no folder {args.out.parent}")
    store = RunStore(args.store or default_root())
    record = store.get(args.name)
    if args.format == "csv":
        flight = getattr(store.load_pair(args.name), args.side)
        text = g1000_csv(record, flight, args.rate)
        with whole_file(args.out) as temporary:
            temporary.write_text(text, encoding="ascii", newline="")
    elif args.format == "rrd":
        from app.scenes.recordings import with_recording

        with_recording(store, args.name)
        with whole_file(args.out) as temporary:
            temporary.write_bytes(store.recording_path(args.name).read_bytes())
    else:
        from app.run_files import export_runs

        export_runs(store, [args.name], args.out)
    size = args.out.stat().st_size
    if args.json:
        print_json({"run": args.name, "out": str(args.out), "bytes": size})
    else:
        print(f"{args.out}: {size / 1e6:.1f} MB")
