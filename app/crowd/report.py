"""What a crowd met, for people and for ``models/results``."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from app.crowd.measure import Crowd
from core.experiments.provenance import provenance
from core.jobs.files import write_json

BUSY = (
    "The machine was busy before the crowd came: delays say little of the server. Measure again "
    "when it is quiet."
)


def kept(crowd: Crowd, folder: Path | None) -> dict[str, Any]:
    """The content of ``crowd.json``, written to ``folder`` if there is one; raises `StoreError`."""
    content = {
        "experiment": "crowd",
        "made_at": datetime.now(UTC).isoformat(timespec="seconds"),
        "provenance": provenance(),
        **crowd.to_dict(),
    }
    if folder is not None:
        write_json(folder / "crowd.json", content)
    return content


def lines(crowd: Crowd) -> list[str]:
    """The figures in a few lines."""
    told = [f"{crowd.pages} pages, each with {crowd.flights.duration_s:g} s of flight of its own"]
    for number, each in enumerate(crowd.rounds, start=1):
        told.append(
            f"round {number}: samples {each.delays.median_s * 1e3:.0f} ms late in the middle, "
            f"{each.delays.p95_s * 1e3:.0f} ms at the 95th percentile, "
            f"{each.delays.max_s * 1e3:.0f} ms at most; server {each.server_mb:.0f} MB and "
            f"{each.cpu_share:.2f} cores; {each.mb_a_page:.2f} MB a page; "
            f"{each.strangers + each.foreign_flights} pages told of others' runs"
        )
    gone_s = crowd.unread.gone_s
    told.append(
        f"with one page that reads nothing: {crowd.unread.others.p95_s * 1e3:.0f} ms at the 95th "
        "percentile for the others; "
        + ("it was never let go" if gone_s is None else f"let go after {gone_s:.0f} s")
    )
    memory = ", ".join(f"{mb:.0f}" for mb in crowd.alone_mb)
    told.append(f"runs on one page, the server after each tenth: {memory} MB")
    return told
