"""OSL shaders of every model, for osl_peer.py.

    python tests/crosscheck/osl_files.py FOLDER

Values are values_of of wgsl_files.py.
"""

import sys
from pathlib import Path

from wgsl_files import values_of

from gonio import catalogue
from gonio.exporting.subject import of_model
from gonio.exporting.targets.shaders.osl import lines_of


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, model in catalogue.items():
        lines = lines_of(of_model(model, values_of(model)), "coating")
        (folder / f"{name}.osl").write_text("\n".join(lines), encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
