"""The whole catalogue on one real scan, as a user asks for it: `make bench-compare`.

Writes benchmarks/compare_all.json and fails where a comparison takes longer than a minute. Arguments are the
weightings, uniform and log without any. Processor time stands beside wall time, because it is what remains of a
measurement on a machine that others use too.
"""

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections import Counter
from datetime import date
from pathlib import Path
from typing import Any

from figures import machine
from gonio.processes.portable import cores

HERE = Path(__file__).resolve().parent
RECORD = HERE / "compare_all.json"
SCAN = HERE.parent.parent / "shared" / "data" / "scans" / "jsss_mwir_aluminium.csv"
BAR = 60.0  # s of wall time, for a scan of about 1 000 points
OPTIONS = ("--models", "all", "--validate", "theta_i")


def measure(weighting: str) -> dict[str, Any]:
    """Wall and processor time of one `gonio compare`, and what became of its fits."""
    with tempfile.TemporaryDirectory() as folder:
        found = Path(folder) / "ranking.json"
        command = [Path(sys.executable).with_name("gonio"), "compare", SCAN, *OPTIONS, "--weighting", weighting]
        before, started = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        subprocess.run([*command, "--json", found], check=True, stdout=subprocess.DEVNULL)
        seconds, after = time.perf_counter() - started, resource.getrusage(resource.RUSAGE_CHILDREN)
        ranking = json.loads(found.read_text(encoding="utf-8"))[0]["ranking"]
    return {
        "weighting": weighting,
        "seconds": round(seconds, 1),
        "processor_seconds": round(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, 1),
        "models": len(ranking),
        "best": {"model": ranking[0]["model"], **ranking[0]["validated"]},
        "statuses": dict(Counter(row["status"] for row in ranking)),
    }


def main() -> int:
    if not SCAN.is_file():
        print(f"no scan at {SCAN}: nothing to measure")
        return 0
    points = sum(not line.startswith("#") for line in SCAN.read_text(encoding="utf-8").splitlines()) - 1
    record = {
        "machine": machine(),
        "cores": cores(),
        "load_before": round(os.getloadavg()[0], 1),
        "date": date.today().isoformat(),
        "command": f"gonio compare {SCAN.name} {' '.join(OPTIONS)} --weighting ..",
        "points": points,
        "runs": [measure(weighting) for weighting in sys.argv[1:] or ("uniform", "log")],
    }
    text = json.dumps(record, indent=1, ensure_ascii=False)
    RECORD.write_text(text + "\n", encoding="utf-8")
    print(text)
    return int(max(run["seconds"] for run in record["runs"]) > BAR)


if __name__ == "__main__":
    sys.exit(main())
