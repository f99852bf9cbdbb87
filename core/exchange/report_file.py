"""The report of a stored run as a file."""

from core.errors import InputError
from core.report.files.export import Exported, to_html, to_markdown
from core.report.files.pdf import to_pdf
from core.store.outcome import run_outcome
from core.store.store import RunStore

FORMATS = ("html", "pdf", "md")


def stored_report(store: RunStore, run_id: str) -> Exported:
    """The stored report of a run with its identity, diagnosis and flight; raises `StoreError`."""
    record = store.get(run_id)
    diagnosis, report = store.load_result(run_id)
    plan = record.plan
    identity = {
        "Run": record.id,
        "Flown": record.created,
        "Plan": f"{plan.altitude_ft:.0f} ft, {plan.speed_kt:.0f} kt, seed {plan.seed}",
        "Version": f"MirrorTwin {record.code_version}",
    }
    outcome = run_outcome(record, diagnosis)
    return Exported(identity, diagnosis, report, store.load_pair(run_id), outcome)


def report_file(given: Exported, kind: str) -> bytes:
    """A report as HTML, PDF or Markdown (`FORMATS`); raises `InputError` for another ``kind``."""
    match kind:
        case "html":
            return to_html(given).encode()
        case "md":
            return to_markdown(given).encode()
        case "pdf":
            return to_pdf(given)
    raise InputError("format", f"must be {', '.join(FORMATS)}, got {kind!r:.20}")
