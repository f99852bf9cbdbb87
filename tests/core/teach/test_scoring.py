"""What answers to a mystery flight are worth, and what a challenge draws."""

import json
from dataclasses import replace

import pytest

from core.diagnosis.diagnosis import Evidence
from core.errors import InputError
from core.fmea.catalogue import catalogue
from core.teach.challenge import LEVELS, ONSET_RANGE_S, Challenge, draw, mode_sets
from core.teach.scoring import RULES, Mark, Score, agreement, judge, near, promptness, score


def moved(channel: str, direction: str, onset_s: float = 60.0) -> Evidence:
    sign = 1.0 if direction == "+" else -1.0
    return Evidence(channel, onset_s, 180.0, sign * 20, "degF", direction, sign * 15, onset_s)  # type: ignore[arg-type]


EVIDENCE = (moved("E1 EGT4", "-"), moved("E1 CHT4", "-", 70.0), moved("E1 RPM", "-"))
RIGHT = tuple(Mark(item.channel, item.onset_s + 5, item.direction) for item in EVIDENCE)
TRUTH = "cylinder_compression"


def test_everything_right_and_quick_is_a_hundred() -> None:
    best = score(TRUTH, TRUTH, EVIDENCE, RIGHT, 60.0, mirror_seen=False)
    assert (best.answer, best.evidence, best.time, best.mirror, best.total) == (60, 30, 10, 0, 100)
    assert best.missed == ()
    assert set(best.verdicts.values()) == {"right"}
    assert Score.from_dict(json.loads(json.dumps(best.to_dict()))) == best
    hinted = score(TRUTH, TRUTH, EVIDENCE, RIGHT, 60.0, mirror_seen=True)
    assert hinted.total == 100 - RULES.mirror_cost


def test_look_alikes_earn_a_part_whichever_of_them_names_the_other() -> None:
    assert near("cylinder_crack", TRUTH) == near(TRUTH, "cylinder_crack") == "look-alike"
    # Engine failure's entry names compression, which does not name it back.
    assert near("engine_failure", TRUTH) == near(TRUTH, "engine_failure") == "look-alike"
    assert near("engine_overspeed", "inflight_anomaly") == "subsystem"
    assert near("baffle_seal", TRUTH) == "far"
    earned = [
        score(answer, TRUTH, EVIDENCE, RIGHT, 60.0, mirror_seen=False).answer
        for answer in (TRUTH, "cylinder_crack", "baffle_seal")
    ]
    assert earned == [60, 24, 0]
    with pytest.raises(InputError, match="unknown mode"):
        near("gremlins", TRUTH)


def test_marks_are_held_to_the_evidence() -> None:
    egt = EVIDENCE[0]
    assert judge(Mark("E1 EGT4", egt.onset_s - RULES.grace_s, "-"), EVIDENCE) == "right"
    assert judge(Mark("E1 EGT4", egt.onset_s - RULES.grace_s - 1, "-"), EVIDENCE) == "early"
    assert judge(Mark("E1 EGT4", 100.0, "+"), EVIDENCE) == "direction"
    assert judge(Mark("volt1", 100.0, "+"), EVIDENCE) == "still"
    one = score(TRUTH, TRUTH, EVIDENCE, RIGHT[:1], 60.0, mirror_seen=False)
    assert one.evidence == 15  # precision 1, recall 1/3
    assert one.missed == ("E1 CHT4", "E1 RPM")
    # Marking everything is no strategy.
    noise = tuple(Mark(name, 100.0, "+") for name in ("volt1", "volt2", "amp1", "amp2", "OAT"))
    assert score(TRUTH, TRUTH, EVIDENCE, RIGHT + noise, 60.0, mirror_seen=False).evidence < 20


def test_a_healthy_flight_has_nothing_to_mark() -> None:
    assert agreement((), {}) == 1.0
    assert agreement((), {"volt1": "still"}) == 0.0
    assert score("nominal", "nominal", (), (), 60.0, mirror_seen=False).total == 100


def test_a_quick_guess_earns_no_time_and_giving_up_earns_nothing() -> None:
    assert promptness(RULES.quick_s) == 1.0
    assert promptness((RULES.quick_s + RULES.slow_s) / 2) == 0.5
    assert promptness(RULES.slow_s + 1) == 0.0
    assert score("baffle_seal", TRUTH, EVIDENCE, (), 1.0, mirror_seen=False).time == 0
    assert score(None, TRUTH, EVIDENCE, RIGHT, 1.0, mirror_seen=True).total == 0


@pytest.mark.parametrize(
    ("values", "field"),
    [
        (("E9 CHT1", 10.0, "+"), "channel"),
        (("E1 CHT1", -1.0, "+"), "time_s"),
        (("E1 CHT1", float("nan"), "+"), "time_s"),
        (("E1 CHT1", 10.0, "sideways"), "direction"),
    ],
)
def test_marks_that_no_chart_offers_are_refused(values: tuple[str, float, str], field: str) -> None:
    with pytest.raises(InputError) as caught:
        Mark(*values)  # type: ignore[arg-type]
    assert caught.value.field == field


def test_a_code_always_hides_the_same_and_only_this_server_knows_what() -> None:
    challenge = Challenge(code="monday")
    assert draw(challenge, b"ours") == draw(challenge, b"ours")
    elsewhere = {draw(challenge, bytes([key]))[1].mode for key in range(20)}
    assert len(elsewhere) > 5
    assert draw(challenge, b"ours") != draw(replace(challenge, code="tuesday"), b"ours")
    assert draw(Challenge(), b"ours") != draw(Challenge(), b"ours")


def test_what_is_drawn_is_what_was_asked_for() -> None:
    subtle = LEVELS[-1]
    for number in range(40):
        challenge = Challenge(
            subtle.severity_low, subtle.severity_high, mode_sets()["cooling"], str(number)
        )
        plan, fault = draw(challenge, b"key")
        assert catalogue()[fault.mode].subsystem in ("cooling", "nominal")
        assert subtle.severity_low <= fault.severity <= subtle.severity_high
        assert ONSET_RANGE_S[0] <= fault.onset_s <= ONSET_RANGE_S[1] < plan.duration_s
        assert (fault.cylinder is None) == catalogue()[fault.mode].whole_engine
    assert all("nominal" in modes for modes in mode_sets().values())


@pytest.mark.parametrize(
    ("values", "field"),
    [
        ({"severity_low": 0.0}, "severity_low"),
        ({"severity_low": 0.9, "severity_high": 0.5}, "severity_low"),
        ({"modes": ("gremlins",)}, "modes"),
        ({"code": "no spaces"}, "code"),
        ({"code": "x" * 21}, "code"),
    ],
)
def test_challenges_that_cannot_be_drawn_are_refused(values: dict[str, object], field: str) -> None:
    with pytest.raises(InputError) as caught:
        Challenge(**values)  # type: ignore[arg-type]
    assert caught.value.field == field
