"""Valid files of every format to begin from, and the damaged ones that follow from seed and number."""

import functools
import importlib
import pkgutil
import shutil
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import height_files
import samples
import stored_files
import tables
from gonio import formats as registry
from gonio.files import FormatError
from mutations import choice, mutated
from places import SHARED

SCAN = "scan"
STORED = {"fit": stored_files.fits, "stack": stored_files.stack_stores, "table": tables.files, **height_files.KINDS}
EASY = 2_000  # bytes; a file that is larger is drawn less often, and gets fewer inputs in a quick run


@dataclass(frozen=True)
class Seed:
    """A valid file, or a directory of files; the name of a single file's content is empty."""

    name: str
    files: dict[str, bytes]

    @property
    def size(self) -> int:
        return sum(map(len, self.files.values()))


def samples_module(name: str) -> str:
    """The module of tests/samples that writes files of a format: the longest name with which the format's begins.

    So `integra_specular` writes files of integra-specular and of integra-specular-transmission.
    """
    wanted = name.replace("-", "_")
    known = [module.name for module in pkgutil.iter_modules(samples.__path__) if wanted.startswith(module.name)]
    return max(known, key=len, default="")


def _content(path: Path) -> Seed:
    if path.is_dir():
        return Seed(
            path.name, {str(p.relative_to(path)): p.read_bytes() for p in sorted(path.rglob("*")) if p.is_file()}
        )
    return Seed(path.name, {"": path.read_bytes()})


@functools.cache
def _real_files() -> list[tuple[str, Path]]:
    """Every file beside the project with the format that it is recognised as."""
    found = []
    for path in sorted(p for p in SHARED.rglob("*") if p.is_file()):
        try:
            found.append((registry.recognise(path).name, path))
        except FormatError:
            continue
    return found


@functools.lru_cache(maxsize=1)  # a format may have 35 MB of them
def seeds(name: str) -> list[Seed]:
    """The valid files of a format: its samples, and the real ones beside the project.

    Of `fit` and `stack` those of `stored_files`, of `table` those of `tables`, of height maps those of
    `height_files`; of `scan` the smallest of every format.
    """
    if name in STORED:
        with tempfile.TemporaryDirectory() as folder:
            return [_content(path) for path in STORED[name](Path(folder))]
    if name == SCAN:
        return [min(seeds(kind), key=lambda seed: seed.size) for kind in registry.formats()]
    found, module = [], samples_module(name)
    if module:
        with tempfile.TemporaryDirectory() as folder:
            written = importlib.import_module(f"samples.{module}").samples(Path(folder))
            found = [_content(path) for path in written if registry.recognise(path).name == name]
    real = [path for kind, path in _real_files() if kind == name]
    # The last format takes what nobody else does: of that only what is called by its name is a sample of it.
    if registry.formats()[name].rank == registry.LAST:
        real = [path for path in real if path.suffix == registry.formats()[name].suffix and "scans" in path.parts]
    found += [_content(path) for path in real]
    if not found:
        raise LookupError(
            f"no file to damage: write tests/samples/{name.replace('-', '_')}.py, "
            f"whose samples(folder) writes {name} files"
        )
    return found


def damaged(name: str, seed: int, number: int) -> tuple[Seed, list[str]]:
    """Input `number` of a format, and what was done to the file that it comes from."""
    rng = np.random.default_rng((seed, number))
    known = seeds(name)
    weights = [1.0 / max(s.size, EASY) for s in known]
    chosen, other = (known[choice(rng, weights)] for _ in range(2))
    part = list(chosen.files)[int(len(chosen.files) * rng.random())]
    strange = next(iter(other.files.values()))
    data, done = mutated(rng, chosen.files[part], strange)
    files: dict[str, Any] = {**chosen.files, part: data}
    if part and rng.random() < 0.05:
        del files[part]
        done = [f"without {part}"]
    return Seed(chosen.name, files), [chosen.name, *done]


def put(made: Seed, folder: Path) -> Path:
    """Write an input; what was there is unlinked first, because a Dataset may still be mapped onto it."""
    path = folder / made.name
    if path.is_dir():
        shutil.rmtree(path)
    path.unlink(missing_ok=True)
    for name, data in made.files.items():
        target = path / name if name else path
        target.parent.mkdir(parents=True, exist_ok=True)
        with target.open("wb") as file:
            file.write(data)
    if not made.files:
        path.mkdir()
    return path
