"""``mirrortwin report``: the report on a run, checked, as a file; and questions about it."""

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from app.cli.output import note, print_json
from core.errors import InputError

if TYPE_CHECKING:
    from core.diagnosis.diagnosis import Diagnosis
    from core.diagnosis.outcome import Outcome
    from core.report.files.export import Exported
    from core.report.write.writers import Writer
    from core.twin.trajectory import Pair

    _Read = tuple[dict[str, str], Pair, Diagnosis, Outcome | None]

DESCRIPTION = """\
Write the report on a run of the app (by its id, as in the address /run/ID) or on a folder that
`mirrortwin simulate` wrote. Every sentence is checked against evidence and FMEA knowledge,
whichever writer wrote it.
"""
EXAMPLES = """\
examples:
  mirrortwin report 20261123T061500-k3x9q2ab --format html --out report.html
  mirrortwin report flight --format pdf --out report.pdf
  mirrortwin report flight --writer local --format json
  mirrortwin report flight --ask "why not the oil cooler?"
"""
FORMATS = ("markdown", "html", "pdf", "json")


def configure(parser: argparse.ArgumentParser) -> None:
    """Add the options of this command, and its writers to the help."""
    from core.report.write.offers import WRITERS

    writers = "".join(
        f"  {row.kind:<11}{row.help.replace(chr(10), chr(10) + 13 * ' ')}\n" for row in WRITERS
    )
    parser.epilog = f"{EXAMPLES}\nwriters:\n{writers}"
    kinds = [row.kind for row in WRITERS]
    parser.add_argument("run_id", metavar="RUN", help="a run id, or a folder written by simulate")
    parser.add_argument("--format", choices=FORMATS, default="markdown", help="default: markdown")
    parser.add_argument("--writer", choices=kinds, default=kinds[0], help=f"default: {kinds[0]}")
    parser.add_argument("--ask", metavar="QUESTION", help="answer a question instead")
    parser.add_argument(
        "--out", type=Path, metavar="FILE", help="write to a file, not the terminal"
    )
    parser.add_argument("--store", type=Path, metavar="DIR", help="where the app keeps its runs")


def run(args: argparse.Namespace) -> None:
    """Print or write the report; raises `InputError`, `StoreError` or `WriterError`."""
    from core.report.write.offers import open_writer

    with open_writer(args.writer) as writer:
        exported = _exported(args, writer)
    for line in exported.report.notes:
        note(line)
    if args.format == "pdf" and args.out is None and sys.stdout.isatty():
        raise InputError("--out", "is needed: a PDF cannot be shown in a terminal")
    if args.format == "json" and args.out is None:
        print_json(_as_json(exported))
        return
    content = _content(exported, args.format, whole=args.ask is None)
    if args.out is None:
        sys.stdout.buffer.write(content)
        return
    try:
        args.out.write_bytes(content)
    except OSError as error:
        raise InputError("--out", f"cannot write {args.out}: {error.strerror}") from None
    print(args.out)


def _exported(args: argparse.Namespace, writer: "Writer") -> "Exported":
    from core.report.case.case import open_case
    from core.report.files.export import Exported
    from core.report.grounded import Done, write_grounded
    from core.report.questions import ask

    folder = Path(args.run_id)
    identity, pair, diagnosis, outcome = (
        _from_folder(folder) if folder.is_dir() else _from_store(args.run_id, args.store)
    )
    events = (
        ask(diagnosis, args.ask, writer)
        if args.ask is not None
        else write_grounded(open_case(diagnosis), writer)
    )
    *_, done = events
    assert isinstance(done, Done)
    return Exported(identity, diagnosis, done.report, pair, outcome)


def _from_folder(folder: Path) -> "_Read":
    from app.cli.diagnose import read_interventions, read_pair, read_plan
    from core.diagnosis.predict import load_diagnoser
    from core.provenance import provenance

    pair, plan = read_pair(folder), read_plan(folder)
    identity = {"Run": folder.name, "Version": f"MirrorTwin {provenance()['mirrortwin']}"}
    diagnoser = load_diagnoser(conditions="lab" if plan is None else plan.conditions)
    diagnosis = diagnoser.diagnose(pair, interventions=read_interventions(folder, pair))
    return identity, pair, diagnosis, _outcome(folder, diagnosis)


def _outcome(folder: Path, diagnosis: "Diagnosis") -> "Outcome | None":
    """The diagnosis beside the injected fault in ``run.json``; None where it holds none.

    It is read after the diagnosis, which never sees it.
    """
    import json

    from core.diagnosis.outcome import Outcome, injected_faults
    from core.fmea.fault import Fault
    from core.twin.actions import read_action
    from core.twin.plan import Plan

    try:
        values = json.loads((folder / "run.json").read_text(encoding="utf-8"))
        plan, fault = Plan.from_dict(values["plan"]), Fault.from_dict(values["fault"])
        actions = [read_action(action) for action in values.get("actions", ())]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, InputError):
        return None
    injected = injected_faults(fault, actions, plan.duration_s)
    return Outcome(injected, diagnosis.top, diagnosis.none_of_these)


def _from_store(run_id: str, root: Path | None) -> "_Read":
    from core.exchange.report_file import stored_report
    from core.store.store import RunStore, default_root

    folder = root or default_root()
    if not folder.is_dir():
        raise InputError("RUN", f"there is no folder {run_id}, and no store of runs at {folder}")
    store = RunStore(folder)
    try:
        stored = stored_report(store, run_id)
    finally:
        store.close()
    assert stored.pair is not None
    return dict(stored.identity), stored.pair, stored.diagnosis, stored.outcome


def _as_json(exported: "Exported") -> dict[str, object]:
    known = {} if exported.outcome is None else {"outcome": exported.outcome.to_dict()}
    return {"about": exported.about, **known, "report": exported.report.to_dict()}


def _content(exported: "Exported", kind: str, *, whole: bool) -> bytes:
    import json

    from core.exchange.report_file import report_file
    from core.report.grounded import as_markdown

    if kind == "json":
        return (json.dumps(_as_json(exported), indent=2, allow_nan=False) + "\n").encode()
    if not whole:
        return (as_markdown(exported.report.sentences) + "\n").encode()
    return report_file(exported, "md" if kind == "markdown" else kind)
