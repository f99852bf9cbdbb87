"""Names and records of runs."""

import json
from typing import Any

import pytest
from jobs_support import CRACK, SHORT_PLAN

from core.errors import InputError
from core.fmea.fault import Fault
from core.store.records import RunRecord, code_version, new_run_id, read_record, valid_run_id
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


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("attempts", 2**70), ("attempts", -1), ("attempts", True), ("attempts", "1"),
        ("code_version", "\ud800"), ("error", "\udfff"), ("error", 5), ("top", ["nominal"]),
        ("created", "9999-12-31T23:59:59+00:00"), ("created", "0001-01-01T00:00:00+14:00"),
        ("created", "yesterday"), ("created", "2026-11-23T06:15:00"), ("created", 5),
        ("status", "lost"), ("status", None), ("top_probability", "0.5"),
        ("top_probability", 2**70), ("top_probability", float("nan")),
        ("id", "x"), ("id", "\ud800"), ("unknown", 1),
        ("plan", []), ("plan", {"speed_kt": 10**400}), ("fault", None), ("actions", 5),
    ],
)  # fmt: skip
def test_what_the_index_or_a_page_cannot_hold_is_no_record(field: str, value: Any) -> None:
    record = RunRecord(
        "20261123T061500-abcdefgh", "2026-11-23T06:15:00+00:00", "done", SHORT_PLAN, CRACK
    )
    values = json.loads(json.dumps(record.to_dict()))
    assert read_record(values) == record
    with pytest.raises(InputError) as caught:
        read_record(values | {field: value})
    assert str(caught.value).isprintable()
