"""The knowledge base: complete, consistent, and refused with a clear message when it is not."""

from pathlib import Path

import pytest

from core.channels import CHANNEL_NAMES
from core.cylinders import CYLINDERS, GROUPS
from core.errors import InputError
from core.fmea.catalogue import catalogue
from core.knowledge.knowledge import (
    depends_on_cylinder,
    knowledge,
    read_knowledge,
    resolve,
)
from core.paths import DATA

KNOWLEDGE_FILE = DATA / "fmea" / "knowledge.toml"


def test_covers_the_catalogue_in_class_order() -> None:
    assert tuple(knowledge()) == tuple(catalogue())


@pytest.mark.parametrize("mode", catalogue())
def test_names_and_ratings_are_those_of_the_catalogue(mode: str) -> None:
    entry, listed = knowledge()[mode], catalogue()[mode]
    assert entry.name == listed.name
    assert (entry.severity, entry.occurrence, entry.detection) == (
        listed.severity_rating,
        listed.occurrence,
        listed.detection,
    )
    assert entry.rpn == listed.rpn
    assert entry.usual_cylinder == (None if listed.whole_engine else listed.cylinder)


@pytest.mark.parametrize("mode", catalogue())
def test_chain_leads_from_a_hidden_defect_to_the_sensors(mode: str) -> None:
    chain = knowledge()[mode].chain
    assert chain[0].channels == ()
    assert any(step.channels for step in chain)


@pytest.mark.parametrize("mode", [mode for mode in catalogue() if mode != "nominal"])
def test_every_sustained_shift_of_a_mode_is_explained_by_its_chain(mode: str) -> None:
    entry = knowledge()[mode]
    for cylinder in CYLINDERS:
        signature = entry.signature(cylinder)
        must_move = {name for name, item in signature.items() if item.sign in ("+", "-")}
        explained = {name for step in entry.chain for name in step.predictions(cylinder)}
        assert must_move
        assert must_move - explained == set()


def test_no_two_modes_share_text() -> None:
    for part in ("summary", "mechanism", "records"):
        texts = [getattr(entry, part) for entry in knowledge().values()]
        assert len(set(texts)) == len(texts)
    actions = [action for entry in knowledge().values() for action in entry.actions]
    assert len(set(actions)) == len(actions)


def signs(mode: str, cylinder: int) -> dict[str, str]:
    return {name: item.sign for name, item in knowledge()[mode].signature(cylinder).items()}


def test_says_of_the_four_faults_what_the_paper_says() -> None:
    """Section 6.2, Fig. 7: the key channels of four representative faults."""
    crack = signs("baffle_crack", 1)
    assert (crack["E1 CHT1"], crack["E1 OilT"], crack["E1 OilP"]) == ("+", "0", "0")
    cooler = signs("oil_cooler_maintenance", 1)
    assert (cooler["E1 OilT"], cooler["E1 OilP"], cooler["E1 RPM"]) == ("+", "-", "0")
    gasket = signs("intake_gasket_leak", 2)
    assert (gasket["E1 EGT2"], gasket["E1 EGT1"]) == ("+", "0")
    failure = signs("engine_failure", 1)
    dead = ("E1 RPM", "E1 OilP", "E1 CHT3", "E1 EGT4", "AltMSL")
    assert {failure[name] for name in dead} == {"-"}


def test_valve_leak_and_cracked_head_are_told_apart_by_opposite_signs() -> None:
    leak, crack = signs("cylinder_compression", 3), signs("cylinder_crack", 3)
    assert (leak["E1 CHT3"], leak["E1 EGT3"]) == ("-", "+")
    assert (crack["E1 CHT3"], crack["E1 EGT3"]) == ("+", "-")


@pytest.mark.parametrize("cylinder", CYLINDERS)
def test_groups_divide_the_engine(cylinder: int) -> None:
    parts = [GROUPS[name](cylinder) for name in ("target", "mate", "across", "diagonal")]
    assert sorted(member for part in parts for member in part) == list(CYLINDERS)
    for one, other in (("bank", "other bank"), ("target", "others"), ("front", "rear")):
        halves = GROUPS[one](cylinder), GROUPS[other](cylinder)
        assert halves[0] | halves[1] == set(CYLINDERS)
        assert halves[0] & halves[1] == set()


def test_resolve_follows_the_engine_layout() -> None:
    assert resolve("CHT bank", 1) == ("E1 CHT1", "E1 CHT3")
    assert resolve("CHT bank", 4) == ("E1 CHT2", "E1 CHT4")
    assert resolve("EGT across", 3) == ("E1 EGT4",)
    assert resolve("EGT others", 2) == ("E1 EGT1", "E1 EGT3", "E1 EGT4")
    assert resolve("CHT front", 4) == ("E1 CHT1", "E1 CHT2")
    for name in CHANNEL_NAMES:
        assert resolve(name, 1) == (name,)


def test_only_relative_groups_depend_on_the_cylinder() -> None:
    for group in GROUPS:
        seen_from = {resolve(f"CHT {group}", cylinder) for cylinder in CYLINDERS}
        assert depends_on_cylinder(f"CHT {group}") == (len(seen_from) > 1)
    assert not depends_on_cylinder("E1 OilT")


@pytest.mark.parametrize("channel", ["CHT", "CHT left", "OIL target", "E1 CHT5", "", "egt all"])
def test_resolve_refuses_what_is_not_a_channel(channel: str) -> None:
    with pytest.raises(InputError, match="neither a channel nor"):
        resolve(channel, 1)


BROKEN = {
    "unknown channel": ('"E1 OilT" = ["0", 0, 2]', '"E1 OilTemp" = ["0", 0, 2]', "baffle_crack"),
    "channel said twice": ('"CHT mate" = ["~", 0.5, 4]', '"CHT all" = ["~", 0.5, 4]', "twice"),
    "sign against range": ('"CHT target" = ["+", 10, 35]', '"CHT target" = ["-", 10, 35]', "sign"),
    "unknown sign": ('"CHT target" = ["+", 10, 35]', '"CHT target" = ["up", 10, 35]', "from, to"),
    "not a number": ('"CHT target" = ["+", 10, 35]', '"CHT target" = ["+", 10, inf]', "sign"),
    "chain against channels": ('"+ CHT target", "~ CHT mate"', '"- CHT target"', r"chain\[4\]"),
    "malformed sign": ('"+ CHT target", "~ CHT mate"', '"CHT target +"', r"chain\[4\].signs"),
    "unknown look-alike": ('mode = "baffle_rivet"', 'mode = "baffle_nail"', r"look_alikes\[1\]"),
    "own look-alike": ('mode = "baffle_rivet"', 'mode = "baffle_crack"', "not another mode"),
    "missing text": ('summary = "A cracked baffle', 'sumary = "A cracked baffle', "sumary"),
    "empty text": ("A cracked baffle panel lets cooling air slip past one cylinder.", "", "text"),
    "raw HTML": ("A cracked baffle panel", "A <b>cracked</b> panel", "summary"),
    "missing mode": ("[baffle_crack", "[baffle_crash", "baffle_crack"),
    "not TOML": ("[baffle_crack]", "[baffle_crack", "not TOML"),
}


@pytest.mark.parametrize("defect", BROKEN)
def test_a_broken_file_is_refused_by_name(defect: str, tmp_path: Path) -> None:
    good, bad, message = BROKEN[defect]
    text = KNOWLEDGE_FILE.read_text(encoding="utf-8")
    head, rest = text.split("[baffle_crack]", 1)
    rest = "[baffle_crack]" + rest
    assert good in rest
    count = -1 if defect == "missing mode" else 1
    path = tmp_path / "knowledge.toml"
    path.write_text(head + rest.replace(good, bad, count), encoding="utf-8")
    with pytest.raises(InputError, match=message):
        read_knowledge(path)


def test_a_mode_that_the_catalogue_lacks_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "knowledge.toml"
    path.write_text(KNOWLEDGE_FILE.read_text(encoding="utf-8") + "\n[propeller_loss]\n", "utf-8")
    with pytest.raises(InputError, match="propeller_loss"):
        read_knowledge(path)


def test_a_missing_file_is_refused_by_path(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"nowhere\.toml"):
        read_knowledge(tmp_path / "nowhere.toml")
