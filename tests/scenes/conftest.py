"""Real parts for the scene tests: a flight of JSBSim, a store, a web server with both viewers."""

import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
import uvicorn
from fastapi import FastAPI
from scenes_support import Flown, Site

from app.scenes.recordings import Recordings
from app.scenes.viser_proxy import ViserScenes
from core.fmea.fault import Fault
from core.jobs.store import RunStore
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
def site(store: RunStore) -> Iterator[Site]:
    """A site of the test's own, over ``store``."""
    app = FastAPI()
    scenes, recordings = ViserScenes(), Recordings(store)
    scenes.mount(app)
    recordings.mount(app)
    with socket.create_server(("127.0.0.1", 0)) as listener:
        host = f"127.0.0.1:{listener.getsockname()[1]}"
        server = uvicorn.Server(uvicorn.Config(app, log_level="error"))
        thread = threading.Thread(target=server.run, kwargs={"sockets": [listener]})
        thread.start()
        while not server.started:
            time.sleep(0.01)
        yield Site(host, scenes, recordings)
        scenes.close_all()
        server.should_exit = True
        thread.join()
