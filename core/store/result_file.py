"""The file ``run.json`` of a run: its record, its diagnosis and its report, with a checksum."""

from pathlib import Path
from shutil import rmtree

from core.diagnosis.diagnosis import Diagnosis
from core.errors import StoreError
from core.files import check_seal, read_json, sealed, write_error, write_json
from core.report.grounded import GroundedReport
from core.store.records import RunRecord


def write_result(
    path: Path, record: RunRecord, diagnosis: Diagnosis, report: GroundedReport
) -> None:
    """Write all three; raises `StoreError`."""
    values = {
        "record": record.to_dict(),
        "diagnosis": diagnosis.to_dict(),
        "report": report.to_dict(),
    }
    write_json(path, sealed(values))


def replace_report(path: Path, report: GroundedReport) -> None:
    """Write another report in the place of the one there; raises `StoreError`."""
    values = read_json(path)
    check_seal(path, values)
    write_json(path, sealed(values | {"report": report.to_dict()}))


def read_result(path: Path) -> tuple[Diagnosis, GroundedReport]:
    """Diagnosis and report in a ``run.json``; raises `StoreError`."""
    values = read_json(path)
    check_seal(path, values)
    try:
        diagnosis = Diagnosis.from_dict(values["diagnosis"])
        return diagnosis, GroundedReport.from_dict(values["report"])
    except (KeyError, TypeError, ValueError) as error:
        raise StoreError(f"{path} is not a result of this version: {error}") from error


def remove_files(root: Path, run_id: str) -> None:
    """Remove the folder of a run; raises `StoreError`."""
    folder = root / "runs" / run_id
    try:
        (folder / "run.json").unlink(missing_ok=True)  # first: nobody takes the rest for a run
    except OSError as error:
        raise write_error(root, error) from error
    rmtree(folder, ignore_errors=True)
