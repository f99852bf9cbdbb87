"""What a stored run's fault was beside what it was diagnosed as."""

from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.outcome import Outcome, injected_faults
from core.store.records import RunRecord


def run_outcome(record: RunRecord, diagnosis: Diagnosis | None = None) -> Outcome | None:
    """What a run came to by a diagnosis of it, else by the verdict in its record.

    None until there is one. The record names the nearest class alone: it does not say whether the
    flight resembles nothing that is known.
    """
    top = record.top if diagnosis is None else diagnosis.top
    if top is None:
        return None
    return Outcome(
        injected_faults(record.fault, record.actions, record.plan.duration_s),
        top,
        diagnosis is not None and diagnosis.none_of_these,
    )
