"""Where the project keeps its data files."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DATA = ROOT / "assets" / "data"
"""What Python reads; nothing of it is served."""

WEB = ROOT / "assets" / "web"
"""What browsers are served, as ``/assets/``."""

MODELS = ROOT / "models"
RESULTS = MODELS / "results"
