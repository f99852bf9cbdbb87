"""Numbers in words, by example."""

import pytest
from report_samples import evidence

from core.channels import CHANNEL_NAMES, channel
from core.clock import clock
from core.knowledge.knowledge import ExpectedShift
from core.report.case.wording import (
    escaped,
    expectation,
    labels,
    moves,
    plain,
    shift,
    sigma,
    with_cylinder,
)


@pytest.mark.parametrize(
    ("time_s", "text"), [(0.0, "0:00"), (59.5, "1:00"), (63.02, "1:03"), (7200.0, "2:00:00")]
)
def test_clock(time_s: float, text: str) -> None:
    assert clock(time_s) == text


@pytest.mark.parametrize(
    ("value", "text"), [(1.04, "1.0 σ"), (-3.46, "3.5 σ"), (9.96, "10 σ"), (296.7, "297 σ")]
)
def test_sigma(value: float, text: str) -> None:
    assert sigma(value) == text


@pytest.mark.parametrize(
    ("name", "value", "text"),
    [
        ("E1 CHT3", 18.34, "+18.3 °F"),
        ("E1 EGT2", -0.3, "-0.3 °F"),
        ("E1 OilT", 0.043, "+0.04 °F"),
        ("E1 FFlow", -5.589, "-5.59 gal/h"),
        ("OAT", 1.2, "+1.2 °C"),
        ("AltMSL", -572.2, "-572 ft"),
    ],
)
def test_shift_has_the_decimals_of_its_channel_and_is_never_zero(
    name: str, value: float, text: str
) -> None:
    assert shift(evidence(name, value)) == text


def test_labels_merge_a_full_set_of_probes() -> None:
    assert labels(["E1 EGT1", "E1 CHT2", "E1 RPM"]) == "Engine speed, CHT 2, EGT 1"
    merged = labels(CHANNEL_NAMES)
    assert "CHT 1-4, EGT 1-4" in merged
    assert len(merged.split(", ")) == 17


def test_moves_merge_a_full_set_of_probes() -> None:
    alike = [evidence(f"E1 CHT{cylinder}", 0.71) for cylinder in (3, 1, 4, 2)]
    assert moves([evidence("E1 OilT", 9.7), *alike]) == [
        "Oil temperature +9.7 °F",
        "CHT 1-4 +0.7 °F",
    ]
    spread = [evidence(f"E1 EGT{cylinder}", -540.0 - cylinder) for cylinder in (1, 2, 3, 4)]
    assert moves(spread) == ["EGT 1-4 -544 to -541 °F"]
    assert moves(alike[:3]) == ["CHT 3 +0.7 °F", "CHT 1 +0.7 °F", "CHT 4 +0.7 °F"]


@pytest.mark.parametrize(
    ("sign", "low", "high", "text"),
    [
        ("+", 10.0, 35.0, "rise by 10 to 35 psi"),
        ("-", -1.2, -0.3, "fall by 0.3 to 1.2 psi"),
        ("0", -0.4, 0.0, "stay put"),
        ("~", -0.8, 0.0, "keep within -0.8 to 0 psi"),
    ],
)
def test_expectation(sign: str, low: float, high: float, text: str) -> None:
    expected = ExpectedShift("E1 OilP", sign, low, high)  # type: ignore[arg-type]
    assert expectation(expected, "E1 OilP") == text


def test_the_cylinder_is_named_only_where_it_is_known() -> None:
    text = "The affected cylinder leans; swap the probe of the affected cylinder."
    assert with_cylinder(text, 4) == "Cylinder 4 leans; swap the probe of cylinder 4."
    assert with_cylinder(text, None) == text


def test_plain_text_cannot_become_markup() -> None:
    assert plain("a\n# b  <i> *c* [d](e)") == r"a \# b \<i\> \*c\* \[d\](e)"


def test_a_comparison_is_no_markup() -> None:
    assert plain("(< 0.1 %) and > 99.9 %") == "(< 0.1 %) and > 99.9 %"
    assert plain("> 5") == r"\> 5"


def test_every_unit_is_printed_as_people_write_it() -> None:
    printed = {shift(evidence(name, 1000.0)).split()[1] for name in CHANNEL_NAMES}
    assert not printed & {"degF", "degC"}
    assert len(printed) == len({channel(name).unit for name in CHANNEL_NAMES})


@pytest.mark.parametrize(
    ("text", "written"),
    [("<", r"\<"), ("<, lab", r"\<, lab"), ("a<b>", r"a\<b\>"), ("< 0.1 %", "< 0.1 %")],
)
def test_only_a_comparison_keeps_its_sign_bare(text: str, written: str) -> None:
    assert escaped(text) == written
