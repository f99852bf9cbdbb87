"""Help that a newcomer can work from, at once."""

import subprocess
import sys

import pytest

from app.cli import COMMANDS
from core.fmea.catalogue import catalogue
from core.twin.plan import PLAN_RANGES


def test_help_names_every_command(mirrortwin):
    done = mirrortwin("--help")
    assert done.returncode == 0
    assert all(name in done.stdout for name in COMMANDS)
    assert mirrortwin().stdout == done.stdout


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_explains_itself_with_examples(mirrortwin, name):
    done = mirrortwin(name, "--help")
    assert done.returncode == 0
    assert f"\n  mirrortwin {name}" in done.stdout


def test_simulate_help_gives_faults_and_ranges(mirrortwin):
    words = mirrortwin("simulate", "--help").stdout.split()
    assert {f"{mode}," for mode in list(catalogue())[:-1]} <= set(words)
    for field in ("altitude_ft", "speed_kt", "heading_deg", "duration_s"):
        low, high, unit = PLAN_RANGES[field]
        assert f"{low:g} to {high:g} {unit}" in " ".join(words)


def test_help_loads_nothing_heavy():
    code = "import sys, app.cli; app.cli.main([]); print(sorted(sys.modules))"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert not any(f"'{name}'" in loaded.stdout for name in ("numpy", "torch", "dash", "jsbsim"))


def test_version(mirrortwin):
    assert mirrortwin("--version").stdout.startswith("mirrortwin ")
