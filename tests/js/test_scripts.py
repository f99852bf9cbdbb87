"""The page's scripts: their own unit tests, and what they must have in common with the server."""

import math
import re
import subprocess
from pathlib import Path

import pytest
from scripts import FOLDER, MODULES, answers, node

from app import scripts as page_scripts
from core.clock import LONGEST_S, clock


def test_the_unit_tests_pass() -> None:
    files = sorted(map(str, FOLDER.glob("*.test.js")))
    done = subprocess.run(
        node("--test", "--test-reporter=spec", *files), capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"^ℹ pass [1-9]", done.stdout, re.M), done.stdout


def test_the_clock_is_the_one_of_python() -> None:
    tenths = [tenth / 10.0 for tenth in range(0, 1300)]
    times = [*tenths, *(57.0 * step / 2 for step in range(round(2 * LONGEST_S / 57.0) + 1))]
    edges = [math.nextafter(edge, way) for edge in (59.5, 60.5, 3599.5) for way in (0.0, LONGEST_S)]
    times += [59.5, 3599.5, 3600.0, LONGEST_S, *edges]
    printed = answers("kit/time.js", "clock", [[time_s] for time_s in times])
    assert printed == [clock(time_s) for time_s in times]


@pytest.mark.parametrize("path", sorted(MODULES.rglob("*.js")), ids=lambda path: path.name)
def test_imports_are_relative_and_name_files(path: Path) -> None:
    """There is no build step: a browser resolves what is written."""
    for name in re.findall(r'^(?:import|export)[^;]*? from "([^"]+)";', path.read_text(), re.M):
        assert name.startswith((".", "..")) and (path.parent / name).is_file(), name


def test_every_module_is_fetched_at_once_from_the_address_of_this_version() -> None:
    head = page_scripts.tags()
    for path in MODULES.rglob("*.js"):
        assert f'href="{page_scripts.BASE}/{path.relative_to(MODULES)}"' in head
    assert f'<script type="module" src="{page_scripts.MAIN}"></script>' in head
