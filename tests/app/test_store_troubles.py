"""What pages say of a store that was removed, and what goes on beside them."""

import asyncio
import shutil
from datetime import timedelta
from pathlib import Path

import pytest

from app.pages.registry import read_address
from app.server import remove_deleted_runs
from core.errors import StoreError
from core.fmea.fault import Fault
from core.store import labels as keeping
from core.store.labels import discard, discarded
from core.store.store import RunStore
from core.twin.plan import Plan


def test_a_store_that_was_removed_is_not_a_run_that_does_not_exist(tmp_path: Path) -> None:
    store = RunStore(tmp_path / "store")
    run_id = store.create(Plan(), Fault()).id
    unknown = read_address("/run/20261123T061500-k3x9q2wz", store)
    assert unknown.problem.startswith("There is no run 20261123T061500-k3x9q2wz")
    shutil.rmtree(store.root)
    for address in (f"/run/{run_id}", f"/compare/{run_id}"):
        problem = read_address(address, store).problem
        assert "was removed or replaced" in problem and "restart MirrorTwin" in problem


def test_what_was_thrown_away_goes_without_anybody_looking(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    store = RunStore(tmp_path / "store")
    run_id = store.create(Plan(), Fault()).id
    store.update(run_id, status="done")
    discard(store, [run_id])
    looked: list[int] = []

    def look(store: RunStore) -> list[str]:
        looked.append(len(discarded(store)))
        if len(looked) == 1:
            raise StoreError("not now")
        return keeping.empty(store, timedelta(0))

    monkeypatch.setattr("app.server.empty", look)

    async def wait() -> None:
        task = asyncio.create_task(remove_deleted_runs(store, 0.01))
        while discarded(store):
            await asyncio.sleep(0.01)
        task.cancel()

    asyncio.run(asyncio.wait_for(wait(), 30.0))
    assert looked[:2] == [1, 1]
