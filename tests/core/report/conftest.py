"""Real diagnoses for the report tests: flown, diagnosed by the shipped network, once a session."""

import random

import pytest

from core.diagnosis.diagnosis import Diagnosis
from core.diagnosis.predict import load_diagnoser
from core.fmea.catalogue import class_ids
from core.fmea.fault import Fault
from core.knowledge.knowledge import knowledge
from core.twin.flight import fly_pair
from core.twin.plan import Plan

FIRST_SEED = 810_000


@pytest.fixture(scope="session")
def flown() -> list[Diagnosis]:
    """One diagnosis of every class, at severities from slight to full, some on other cylinders."""
    rng = random.Random(5)
    found = []
    for index, mode in enumerate(class_ids()):
        cylinder = rng.choice((1, 2, 3, 4)) if knowledge()[mode].names_cylinder else None
        fault = Fault(mode, (0.3, 0.6, 0.9)[index % 3], 60.0 + 2.0 * index, cylinder)
        pair = fly_pair(Plan.sampled(FIRST_SEED + index), fault)
        found.append(load_diagnoser().diagnose(pair))
    return found
