"""The table of channels, and that a forgotten channel stops the program instead of passing."""

import subprocess
import sys
from pathlib import Path

import pytest

from core.channels import CHANNEL_NAMES, CHANNELS, check_covers, read_channels
from core.cylinders import CYLINDERS
from core.errors import InputError
from core.exchange.g1000_writer import COLUMN_NAMES
from core.paths import DATA, ROOT
from core.twin.sensors import EQUATIONS

TABLE = DATA / "channels.toml"


def test_a_row_with_a_cylinder_in_its_name_stands_for_each() -> None:
    heads = [one for one in CHANNELS if one.name.startswith("E1 CHT")]
    assert [one.name for one in heads] == [f"E1 CHT{cylinder}" for cylinder in CYLINDERS]
    assert [one.label for one in heads] == [f"CHT {cylinder}" for cylinder in CYLINDERS]


def test_what_is_derived_from_the_table_names_its_channels() -> None:
    assert set(EQUATIONS) == set(CHANNEL_NAMES) <= set(COLUMN_NAMES)


@pytest.mark.parametrize(
    ("names", "problem"),
    [
        (CHANNEL_NAMES[1:], f"{CHANNEL_NAMES[0]} is missing"),
        ((*CHANNEL_NAMES, CHANNEL_NAMES[-1]), "is there twice"),
        ((*CHANNEL_NAMES, "E2 MAP"), "E2 MAP is not a channel"),
    ],
)
def test_names_that_are_not_the_channels_are_refused(names: tuple[str, ...], problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        check_covers("the equations", names)


NEW_ROW = """
["E2 MAP"]
label = "Manifold pressure"
unit = "inHg"
subsystem = "engine"
full_scale = 30.0
decimals = 1
real = { noise_sd = 0.05, wander_sd = 0.0, wander_tau_s = 1.0, step = 0.1 }
field = { white_sd = 0.05, spread = 0.15 }
g1000 = { unit = "Hg", width = 6, decimals = 2 }
"""


def test_a_channel_without_an_equation_stops_the_import(tmp_path: Path) -> None:
    """In a copy of the program whose table has a channel more."""
    for name in ("core", "assets"):
        (tmp_path / name).mkdir()
        for part in (ROOT / name).iterdir():
            (tmp_path / name / part.name).symlink_to(part)
    (tmp_path / "core" / "paths.py").unlink()
    (tmp_path / "core" / "paths.py").write_text((ROOT / "core" / "paths.py").read_text())
    (tmp_path / "assets" / "data").unlink()
    (tmp_path / "assets" / "data").mkdir()
    for part in DATA.iterdir():
        (tmp_path / "assets" / "data" / part.name).symlink_to(part)
    (tmp_path / "assets" / "data" / TABLE.name).unlink()
    (tmp_path / "assets" / "data" / TABLE.name).write_text(TABLE.read_text() + NEW_ROW)
    run = subprocess.run(
        [sys.executable, "-c", "import core.twin.sensors"],
        cwd=tmp_path, env={"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True,
    )  # fmt: skip
    assert run.returncode != 0
    assert "the equations of core/twin/sensors.py: E2 MAP is missing" in run.stderr


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ('unit = "V"\n', "", r"channels\.volt1"),
        ('subsystem = "electrical"', 'subsystem = "electric"', "must be one of"),
        ("real = {", "reel = {", r"channels\.volt1\.real: is missing"),
        ('["volt1"]', '["volt1"', "not TOML"),
    ],
)
def test_a_bad_table_is_named(tmp_path: Path, old: str, new: str, problem: str) -> None:
    good = TABLE.read_text(encoding="utf-8")
    path = tmp_path / "channels.toml"
    path.write_text(good.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(InputError, match=problem):
        read_channels(path)
