"""Real parts for the scene tests: a flight of JSBSim, a store, a web server with both viewers."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi import FastAPI
from scenes_support import Flown, Site

from app.scenes.recordings import Recordings
from app.scenes.viser_proxy import ViserScenes
from core.fmea.fault import Fault
from core.store.store import RunStore
from core.twin.flight import fly_pair
from core.twin.plan import Plan


@pytest.fixture(scope="session")
def flown() -> Flown:
    """An engine failure, two minutes, heading a little west of north."""
    plan = Plan(heading_deg=350.0, duration_s=120.0, seed=5)
    fault = Fault("engine_failure", severity=0.8, onset_s=40.0)
    return Flown(plan, fault, fly_pair(plan, fault))


@pytest.fixture
def store(tmp_path: Path) -> Iterator[RunStore]:
    """An empty store."""
    opened = RunStore(tmp_path / "store")
    yield opened
    opened.close()


@pytest.fixture
def site(store: RunStore, serve_app: Any) -> Iterator[Site]:
    """A site of the test's own, over ``store``."""
    app = FastAPI()
    scenes, recordings = ViserScenes(), Recordings(store)
    scenes.mount(app)
    recordings.mount(app)
    with serve_app(lambda port: app) as url:
        yield Site(url.removeprefix("http://"), scenes, recordings)
        scenes.close_all()
