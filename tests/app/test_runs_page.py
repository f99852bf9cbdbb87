"""The page Runs as it is laid out: what is where, and what is never markup."""

import json
from dataclasses import replace
from typing import Any

from app.pages.runs import page as runs
from core.fmea.fault import Fault
from core.store.labels import Label
from core.store.records import RunRecord
from core.twin.actions import Repair, SetFault
from core.twin.plan import Plan

MARKUP = "<img src=x onerror=alert(1)>"
RECORD = RunRecord(
    "20261123T061500-k3x9q2wz", "2026-11-23T06:15:00.400000+00:00", "done",
    Plan(seed=3), Fault("baffle_crack", 0.7, 80.0), top="baffle_crack", top_probability=0.91,
)  # fmt: skip


def plain(component: Any) -> Any:
    """A component and all in it as Dash sends it."""
    return json.loads(json.dumps(component, default=lambda item: item.to_plotly_json()))


def found(tree: Any, kind: str) -> list[dict[str, Any]]:
    """Every component of that type."""
    here = [tree] if isinstance(tree, dict) and tree.get("type") == kind else []
    inner = tree.values() if isinstance(tree, dict) else tree if isinstance(tree, list) else ()
    return here + [item for value in inner for item in found(value, kind)]


def test_a_row_sorts_as_numbers_and_says_whether_the_diagnosis_was_right() -> None:
    row = runs.row_of(RECORD, Label(("a", "b"), "note"))
    assert (row["severity"], row["onset_s"], row["seed"]) == (0.7, 80.0, 3)
    assert (row["diagnosis"], row["right"], row["tags"]) == ("Baffle crack", True, "a, b")
    assert not runs.row_of(replace(RECORD, top="nominal"), Label())["right"]
    harmless = replace(RECORD, fault=Fault("baffle_crack", 0.0, 80.0), top="nominal")
    assert runs.row_of(harmless, Label())["right"], "severity 0 equals nominal"
    second = (SetFault(90.0, "engine_failure"), Repair(120.0))
    assert runs.row_of(replace(RECORD, top="engine_failure", actions=second), Label())["right"]
    nominal = runs.row_of(replace(RECORD, fault=Fault("nominal"), top=None), Label())
    assert nominal["severity"] is nominal["right"] is None


def test_what_people_wrote_goes_nowhere_but_into_cells() -> None:
    label = Label((MARKUP,), MARKUP)
    tree = plain(runs.layout([RECORD], {RECORD.id: label}, []))
    (grid,) = found(tree, "AgGrid")
    (row,) = grid["props"]["rowData"]
    assert row["tags"] == row["note"] == MARKUP
    row.update(tags="", note="")
    assert MARKUP not in json.dumps(tree)
    assert not grid["props"].get("dangerously_allow_code")
    assert "markdown" not in json.dumps(grid["props"]["columnDefs"])
    assert not found(tree, "Markdown") and not found(tree, "DangerouslySetInnerHTML")


def test_what_was_deleted_can_be_undone_after_a_reload() -> None:
    tree = json.dumps(plain(runs.layout([], {}, [RECORD.id])))
    assert "1 run deleted" in tree and RECORD.id in tree
    assert "Fly the first one" in json.dumps(plain(runs.layout([], {}, [])))


def test_a_clock_runs_only_while_something_flies() -> None:
    def is_disabled(record: RunRecord) -> bool:
        (clock,) = found(plain(runs.layout([record], {}, [])), "Interval")
        return bool(clock["props"]["disabled"])

    assert is_disabled(RECORD)
    assert not is_disabled(replace(RECORD, status="running"))
