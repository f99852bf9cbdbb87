"""``mirrortwin export``: a stored run as files."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.output import print_json, writable_folder
from core.errors import InputError

if TYPE_CHECKING:
    from core.store.store import RunStore

DESCRIPTION = """\
Write a finished run of the store to a file: everything, as a zip that `mirrortwin import` and the
page Runs can import; its flights as Garmin G1000 logs; or its Rerun recording.

A name without a suffix, or of an existing folder, is a folder: files get names of their own in it,
and csv writes both flights.
"""
EXAMPLES = """\
examples:
  mirrortwin export 20261123T061500-k3x9q2wz --out run.zip
  mirrortwin export 20261123T061500-k3x9q2wz --format csv --out logs
  mirrortwin export 20261123T061500-k3x9q2wz --format csv --side mirror --out mirror.csv
  mirrortwin export 20261123T061500-k3x9q2wz --format rrd --out run.rrd
"""


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command."""
    parser.add_argument("name", metavar="RUN", help="the run's name, as in its address")
    parser.add_argument(
        "--out", type=Path, required=True, metavar="FILE|DIR",
        help="the file to write, or a folder for it",
    )  # fmt: skip
    parser.add_argument("--format", choices=("zip", "csv", "rrd"), default="zip")
    parser.add_argument(
        "--side", choices=("faulted", "mirror"),
        help="which flight, for csv (default: both into a folder, faulted into a file)",
    )  # fmt: skip
    parser.add_argument(
        "--rate", type=int, default=1, metavar="HZ", help="rows a second, for csv (default 1)"
    )
    parser.add_argument(
        "--store", type=Path, metavar="DIR",
        help="where runs are kept (default: $MIRRORTWIN_HOME, else .mirrortwin)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="print what was written as JSON")


def run(args: argparse.Namespace) -> None:
    """Write the files; raises `InputError` or `StoreError`."""
    from core.store.store import RunStore, default_root

    out: Path = args.out
    into_folder = out.is_dir() or not out.suffix
    if not into_folder and not out.parent.is_dir():
        raise InputError("out", f"there is no folder {out.parent}")
    store = RunStore(args.store or default_root())
    if args.format == "csv":
        files = _write_logs(store, args, into_folder)
    else:
        files = [_write_whole(store, args, into_folder)]
    sizes = {str(path): path.stat().st_size for path in files}
    if args.json:
        total = sum(sizes.values())
        print_json({"run": args.name, "out": str(out), "files": list(sizes), "bytes": total})
        return
    for path, size in sizes.items():
        print(f"{path}: {size / 1e6:.1f} MB")


def _write_logs(store: "RunStore", args: argparse.Namespace, into_folder: bool) -> list[Path]:
    """Write the flights asked for as logs, a file each."""
    from core.exchange.g1000_writer import SIDES, g1000_csv, log_name
    from core.files import whole_file

    record, pair = store.get(args.name), store.load_pair(args.name)
    default = SIDES if into_folder else SIDES[:1]
    sides = [side for side in SIDES if side == args.side] if args.side else default
    texts = {side: g1000_csv(record, getattr(pair, side), args.rate, side=side) for side in sides}
    files = []
    for side, text in texts.items():
        path = writable_folder(args.out) / log_name(record, side) if into_folder else args.out
        with whole_file(path) as temporary:
            temporary.write_text(text, encoding="ascii", newline="")
        files.append(path)
    return files


def _write_whole(store: "RunStore", args: argparse.Namespace, into_folder: bool) -> Path:
    """Write the run as a zip, or its recording."""
    from app.archives import export_runs
    from app.scenes.recordings import with_recording
    from core.files import whole_file

    record = store.get(args.name)
    path: Path = args.out
    if into_folder:
        path = writable_folder(path) / f"mirrortwin-{record.id}.{args.format}"
    if args.format == "zip":
        export_runs(store, [record.id], path)
        return path
    with_recording(store, record.id)
    with whole_file(path) as temporary:
        temporary.write_bytes(store.recording_path(record.id).read_bytes())
    return path
