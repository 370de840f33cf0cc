"""Where the project's root is, and the measured data beside it, which a checkout may lack."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SHARED = ROOT.parent / "shared" / "data"
FILES = SHARED / "files"
