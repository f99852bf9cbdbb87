"""Which code made a thing: versions and a fingerprint of the twin."""

import hashlib
import subprocess
from importlib.metadata import version
from pathlib import Path

from core.paths import ROOT

TWIN_SOURCES: tuple[str, ...] = (
    "core/channels.py",
    "core/clock.py",
    "core/cylinders.py",
    "core/twin/*.py",
    "core/fmea/*.py",
    "assets/data/fmea/catalogue.toml",
    "assets/data/aircraft/**/*.xml",
)
"""What a flight's bytes depend on."""


def provenance() -> dict[str, str]:
    """Versions of the code, its commit, the twin's fingerprint and the libraries that matter."""
    return {
        "mirrortwin": version("mirrortwin"),
        "commit": _commit(),
        "twin": twin_fingerprint(),
        **{name: version(name) for name in ("jsbsim", "numpy", "scipy", "torch")},
    }


def twin_fingerprint(root: Path = ROOT) -> str:
    """A digest of every file that shapes a flight: equal digests fly equal flights."""
    digest = hashlib.sha256()
    for pattern in TWIN_SOURCES:
        for path in sorted(root.glob(pattern)):
            name = path.relative_to(root).as_posix()
            digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _commit() -> str:
    """The commit checked out, ``unknown`` outside a checkout."""
    try:
        found = subprocess.run(
            ["git", "rev-parse", "--short=12", "HEAD"],
            cwd=ROOT, capture_output=True, text=True, check=True,
        )  # fmt: skip
    except (OSError, subprocess.CalledProcessError):
        return "unknown"
    return found.stdout.strip()
