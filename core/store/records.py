"""The record of one run: its plan, its fault, its status and its result in short."""

import re
import secrets
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache
from typing import Any, Literal, get_args

from core.errors import InputError
from core.fmea.fault import Fault
from core.provenance import provenance
from core.twin.actions import Action, action_to_dict, first_fault, in_order, read_action
from core.twin.plan import Plan

Status = Literal["queued", "running", "done", "failed", "cancelled"]

STATUSES: tuple[Status, ...] = get_args(Status)
UNFINISHED: tuple[Status, ...] = ("queued", "running")

# Letters and digits that nobody mistakes for one another when a run's name is read aloud.
_ALPHABET = "23456789abcdefghjkmnpqrstuvwxyz"
_SUFFIX_LENGTH = 8
_MAX_TEXT = 2000
_FIRST_YEAR, _LAST_YEAR = 2000, 2199
_MOST_ATTEMPTS = 1000
_TIME = "must be a time with its zone, such as 2026-11-23T06:15:00Z"
_RUN_ID = re.compile(rf"\d{{8}}T\d{{6}}-[{_ALPHABET}]{{{_SUFFIX_LENGTH}}}")


@dataclass(frozen=True, slots=True)
class RunRecord:
    """One run in the index.

    ``created``: ISO 8601, UTC. ``error``: a sentence for the user, None unless failed. ``top``
    and ``top_probability``: the verdict, None until diagnosed. ``attempts``: how often a worker
    has begun this run since it was last submitted. ``actions``: what is done on the way.
    """

    id: str
    created: str
    status: Status
    plan: Plan
    fault: Fault
    error: str | None = None
    code_version: str = ""
    top: str | None = None
    top_probability: float | None = None
    attempts: int = 0
    actions: tuple[Action, ...] = ()

    @property
    def first_fault(self) -> Fault | None:
        """The first fault that sets in, planned or injected on the way; None if none does."""
        return first_fault(self.fault, self.actions)

    @property
    def finished(self) -> bool:
        """Whether nothing more will happen to it unless someone runs it again."""
        return self.status not in UNFINISHED

    def to_dict(self) -> dict[str, Any]:
        """Plain JSON-ready values."""
        return {
            "id": self.id,
            "created": self.created,
            "status": self.status,
            "plan": self.plan.to_dict(),
            "fault": self.fault.to_dict(),
            "error": self.error,
            "code_version": self.code_version,
            "top": self.top,
            "top_probability": self.top_probability,
            "attempts": self.attempts,
            "actions": [action_to_dict(action) for action in self.actions],
        }


def read_record(values: dict[str, Any]) -> RunRecord:
    """Read what `RunRecord.to_dict` wrote, from wherever; raises `InputError` naming the field."""
    try:
        if not all(isinstance(values[name], Mapping) for name in ("plan", "fault")):
            raise InputError("record", "must have a plan and a fault that are tables of values")
        plan, fault = Plan.from_dict(values["plan"]), Fault.from_dict(values["fault"])
        actions = in_order(map(read_action, values.get("actions", ())), plan)
        record = RunRecord(**{**values, "plan": plan, "fault": fault, "actions": actions})
    except (KeyError, TypeError, AttributeError, OverflowError) as error:
        raise InputError("record", f"is not one of this version: {error}") from None
    fault.check_within(plan.duration_s)
    check_record(record)
    if not valid_run_id(record.id):
        raise InputError("id", f"must be like {new_run_id()}, got {record.id!r:.60}")
    if len(record.code_version) > _MAX_TEXT or len(str(record.error)) > _MAX_TEXT:
        raise InputError("record", f"must have texts of {_MAX_TEXT} characters at most")
    if datetime.fromisoformat(record.created).tzinfo is None:
        raise InputError("created", _TIME)
    return record


def check_record(record: RunRecord) -> None:
    """Raise `InputError` for what neither the index takes nor a page can show.

    What is in a row or a file may have been written by anybody.
    """
    for name in ("id", "created", "status", "code_version", "error", "top"):
        text = getattr(record, name)
        if text is None and name in ("error", "top"):
            continue
        if not isinstance(text, str):
            raise InputError(name, "must be text")
        if not is_storable(text):
            raise InputError(name, "holds half a character (a lone surrogate)")
    if record.status not in STATUSES:
        raise InputError("status", f"must be one of {', '.join(STATUSES)}")
    try:
        created = datetime.fromisoformat(record.created)
    except ValueError:
        raise InputError("created", _TIME) from None
    if not _FIRST_YEAR <= created.year <= _LAST_YEAR:
        raise InputError("created", f"must lie in the years {_FIRST_YEAR} to {_LAST_YEAR}, "
                         f"got {record.created:.40}")  # fmt: skip
    share: object = record.top_probability
    if share is not None and not (isinstance(share, int | float) and 0.0 <= share <= 1.0):
        raise InputError("top_probability", "must be a number, 0 to 1")
    attempts: object = record.attempts
    if isinstance(attempts, bool) or not isinstance(attempts, int):
        raise InputError("attempts", "must be a whole number")
    if not 0 <= attempts <= _MOST_ATTEMPTS:
        raise InputError("attempts", f"must lie in 0 to {_MOST_ATTEMPTS}")


def is_storable(text: str) -> bool:
    r"""Whether a text can be written at all: JSON can hold halves of characters, UTF-8 cannot.

    >>> is_storable("Zürich"), is_storable("\ud800")
    (True, False)
    """
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def new_run_id() -> str:
    """A fresh name, such as ``20261123T061500-k3x9q2wz``: it goes into addresses and folders.

    It sorts by time (UTC). Its last part carries 39 random bits: a run is shared by its link.
    """
    suffix = "".join(secrets.choice(_ALPHABET) for _ in range(_SUFFIX_LENGTH))
    return f"{datetime.now(UTC):%Y%m%dT%H%M%S}-{suffix}"


def valid_run_id(run_id: str) -> bool:
    """Whether ``run_id`` has the form of a name, so that it is safe in a path."""
    return _RUN_ID.fullmatch(run_id) is not None


@cache
def code_version() -> str:
    """What flies here: package version, commit, and the fingerprint of the twin's sources."""
    made_by = provenance()
    return f"{made_by['mirrortwin']} (commit {made_by['commit']}, twin {made_by['twin']})"
