"""What the scene tests share: a flown run as the worker streams it, and a site that shows it."""

from dataclasses import dataclass

from app.scenes.recordings import Recordings
from app.scenes.viser_proxy import ViserScenes
from core.fmea.fault import Fault
from core.jobs.events import SAMPLE_STRIDE, Samples
from core.twin.plan import Plan
from core.twin.trajectory import Pair


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
