"""Names and records of runs."""

import json

import pytest
from jobs_support import CRACK, SHORT_PLAN

from core.fmea.fault import Fault
from core.jobs.records import RunRecord, code_version, new_run_id, valid_run_id
from core.twin.plan import Plan


def test_new_names_are_valid_and_differ() -> None:
    names = {new_run_id() for _ in range(500)}
    assert len(names) == 500
    assert all(valid_run_id(name) for name in names)


@pytest.mark.parametrize(
    "name",
    ["", "nonsense", "..", "20261123T061500-../../etc", "20261123T061500-abcdefgh\n",
     "20261123T061500-ABCDEFGH", "20261123T061500-abcdefg", "x20261123T061500-abcdefgh"],
)  # fmt: skip
def test_what_is_no_name(name: str) -> None:
    assert not valid_run_id(name)


def test_a_record_survives_json() -> None:
    record = RunRecord("20261123T061500-abcdefgh", "2026-11-23T06:15:00", "done", SHORT_PLAN, CRACK)
    values = json.loads(json.dumps(record.to_dict()))
    assert Plan.from_dict(values.pop("plan")) == SHORT_PLAN
    assert Fault.from_dict(values.pop("fault")) == CRACK
    assert values["status"] == "done"


def test_the_code_version_names_the_twin() -> None:
    assert "twin" in code_version()
