"""Real parts for the scene tests: a flight of JSBSim, a store, a web server with both viewers."""

import socket
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import uvicorn
from fastapi import FastAPI

from app.scenes.recordings import Recordings
from app.scenes.viser_proxy import ViserScenes
from core.fmea.fault import Fault
from core.jobs.events import SAMPLE_STRIDE, Samples
from core.jobs.store import RunStore
from core.twin.flight import fly_pair
from core.twin.plan import Plan
from core.twin.trajectory import Pair

PLAN = Plan(heading_deg=350.0, duration_s=120.0, seed=5)
FAULT = Fault("engine_failure", severity=0.8, onset_s=40.0)


@dataclass(frozen=True)
class Flown:
    """A flown run: what was asked for and what came of it."""

    plan: Plan
    fault: Fault
    pair: Pair

    def samples(self, size: int = 25) -> list[Samples]:
        """The run as the worker streams it: 5 Hz, in batches of ``size``."""
        thin = self.pair[::SAMPLE_STRIDE]
        starts = range(0, len(thin.mirror), size)
        return [_samples(index, thin[index : index + size]) for index in starts]


def _samples(index: int, block: Pair) -> Samples:
    faulted, mirror = block.faulted, block.mirror
    return Samples(
        run_id="run",
        index=index,
        time_s=mirror.time_s.astype("f4"),
        faulted=faulted.channels,
        mirror=mirror.channels,
        faulted_states=faulted.states.astype("f4"),
        mirror_states=mirror.states.astype("f4"),
    )


@pytest.fixture(scope="session")
def flown() -> Flown:
    """An engine failure, two minutes, heading a little west of north."""
    return Flown(PLAN, FAULT, fly_pair(PLAN, FAULT))


@pytest.fixture
def store(tmp_path: Path) -> Iterator[RunStore]:
    """An empty store."""
    opened = RunStore(tmp_path / "store")
    yield opened
    opened.close()


@dataclass(frozen=True)
class Site:
    """A web server with nothing but the two viewers."""

    host: str
    scenes: ViserScenes
    recordings: Recordings

    @property
    def url(self) -> str:
        """Its address."""
        return f"http://{self.host}"


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
