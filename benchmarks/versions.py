"""Keeps in versions.json with which versions the tests passed: `make lowest` and `make newest`.

Run by the Python of that environment once its tests have passed: versions.py NAME.
"""

import json
import platform
import re
import sys
from datetime import date
from importlib.metadata import requires, version
from pathlib import Path

RECORD = Path(__file__).with_name("versions.json")


def main(name: str) -> None:
    needed = sorted({re.split(r"[\[><=!~; ]", line)[0] for line in requires("gonio") or [] if "extra ==" not in line})
    record = json.loads(RECORD.read_text(encoding="utf-8")) if RECORD.exists() else {}
    record[name] = {
        "date": date.today().isoformat(),
        "system": f"{platform.system()} {platform.machine()}",
        "python": platform.python_version(),
        "packages": {package: version(package) for package in needed},
    }
    RECORD.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")
    print(json.dumps(record[name], indent=1))


if __name__ == "__main__":
    main(sys.argv[1])
