"""The measure of speed, and that workers change nothing but that."""

import pytest

from core.experiments.cost.bench import (
    FULL,
    LongRound,
    Round,
    Workload,
    bare_loop_s,
    fly_on_worker,
    workers,
)
from core.twin.plan import Plan


def test_ratios_by_hand():
    seconds = Round(bare_s=0.1, trajectory_s=0.15, pair_s=0.28)
    assert seconds.ratios() == pytest.approx({"trajectory_ratio": 1.5, "pair_ratio": 2.8})
    long = LongRound(
        pair_s=0.28, long_pair_s=6.72, one_worker_s=9.0, two_workers_s=5.0, worker_share=1.0
    )
    assert long.ratios(FULL) == pytest.approx(
        {"long_flight_cost_ratio": 1.0, "two_worker_speedup": 1.8}
    )
    assert long.ratios(Workload(3600.0, 64))["long_flight_cost_ratio"] == pytest.approx(2.0)


def test_the_bare_loop_costs_what_its_steps_cost():
    short, long = (
        min(bare_loop_s(Plan(duration_s=seconds)) for _ in range(3)) for seconds in (60.0, 240.0)
    )
    assert long / short == pytest.approx(4.0, rel=0.4)


@pytest.mark.slow
def test_bytes_do_not_depend_on_workers_or_order():
    seeds = [3, 1, 4, 15]
    here = {seed: fly_on_worker(seed).digest for seed in seeds}
    assert len(set(here.values())) == len(seeds)
    for number, order in ((1, seeds), (2, seeds[::-1])):
        with workers(number) as client:
            flown = client.gather(client.map(fly_on_worker, order, pure=False))
        assert {seed: each.digest for seed, each in zip(order, flown, strict=True)} == here
