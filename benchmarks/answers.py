"""What `gonio fit SCAN` answers on the measured scans with nothing else asked, and how long it takes: `make answers`.

Writes benchmarks/answers.json, which docs/answers.md is made from. Each scan is taken as the file is, with the values
that its header says to leave out; every command is a process of its own, one after another.
"""

import json
import platform
import subprocess
import sys
import time
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from rich.progress import track

from gonio.processes.portable import cores
from surfaces import DATA, SCANS

HERE = Path(__file__).resolve().parent
PEERS = {
    "AnoBlackEC1onAlum": DATA / "files" / "fred" / "AnoBlackEC1onAlum.txt",
    "merl_aluminium_slice": DATA / "files" / "columns" / "merl_aluminium_slice.csv",
}


def gonio(*arguments: str) -> tuple[Any, float]:
    """What a command prints as JSON, and the seconds that it took."""
    started = time.perf_counter()
    done = subprocess.run([sys.executable, "-m", "gonio", *arguments, "--json", "-"], capture_output=True, check=True)
    return json.loads(done.stdout), time.perf_counter() - started


def answered(path: Path) -> dict[str, Any]:
    record, seconds = gonio("fit", str(path))
    return {
        "points": record["points"],
        "weighting": record["weighting"],
        "model": record["model"],
        "fitted": record["metrics"]["log10_rmse"],
        "left_out": record["validated"]["log10_rmse"],
        "verdict": record["verdict"],
        "contradicted": sum(one["points"] for one in record["contradicted"]),
        "fitted_in_full": sum(one["validated"] is not None for one in record["tried"]),
        "seconds": round(seconds, 1),
    }


def compared(path: Path) -> dict[str, Any]:
    """The best fit of fewer than 13 values where all models are compared and no weighting is named."""
    [record], seconds = gonio("compare", str(path), "--models", "all", "--validate", "theta_i")
    few = [row for row in record["ranking"] if row["free_parameters"] < 13]
    best = min(few, key=lambda row: row["metrics"]["log10_rmse"] or 9.0)
    return {"model": best["model"], "fitted": best["metrics"]["log10_rmse"], "seconds": round(seconds, 1)}


def main() -> int:
    if not DATA.is_dir():
        print(f"no measured data at {DATA}: nothing to do")
        return 0
    scans = {
        path.stem: answered(path)
        for path in track(sorted(SCANS.glob("*.csv")), "answering", disable=not sys.stderr.isatty())
    }
    found = {
        "date": datetime.now(UTC).date().isoformat(),
        "machine": f"{platform.machine()}, {cores()} cores, Python {platform.python_version()}",
        "scans": scans,
        "compared": {name: compared(path) for name, path in PEERS.items()},
    }
    (HERE / "answers.json").write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
