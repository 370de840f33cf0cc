"""What all tests share: the real scans beside the project, and the array libraries."""

import importlib
import os
import pkgutil
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

import samples
from browser import shared
from gonio import published, simulate
from gonio.formats import recognise
from gonio.models import catalogue
from places import ROOT

# One run of a submission must not fail where the next one passes: CI draws the same examples each time.
settings.register_profile("ci", derandomize=True)
if os.environ.get("CI"):
    settings.load_profile("ci")

# A shell that starts tests in the background has them ignore these signals; what they start would inherit that, and
# would not end.
for name, handler in (("SIGINT", signal.default_int_handler), ("SIGHUP", signal.SIG_DFL)):
    if signal.getsignal(number := getattr(signal, name, signal.SIGINT)) is signal.SIG_IGN:
        signal.signal(number, handler)

SHARED_SCANS = ROOT.parent / "shared" / "data" / "scans"


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """A test that asks for `real_scan` runs once a file; without the folder it is skipped with a message."""
    if "real_scan" in metafunc.fixturenames:
        files = sorted(SHARED_SCANS.glob("*.csv"))
        skip = pytest.mark.skip(reason=f"no measured scans at {SHARED_SCANS}")
        scans = files or [pytest.param(None, marks=skip)]
        metafunc.parametrize("real_scan", scans, ids=lambda path: path.stem if path else "absent")


@pytest.fixture(scope="session")
def shared_scans() -> Path:
    if not SHARED_SCANS.is_dir():
        pytest.skip(f"no measured scans at {SHARED_SCANS}")
    return SHARED_SCANS


@pytest.fixture(scope="session")
def sample_files(tmp_path_factory) -> dict[str, list[Path]]:
    """Small files of every format, by the format that they are recognised as."""
    found: dict[str, list[Path]] = {}
    for module in pkgutil.iter_modules(samples.__path__):
        folder = tmp_path_factory.mktemp(module.name)
        for path in importlib.import_module(f"samples.{module.name}").samples(folder):
            found.setdefault(recognise(path).name, []).append(path)
    return found


@pytest.fixture
def coarse_grids(monkeypatch):
    """Files that are small, and quick to make: what is tried is not their digits, for which formats have own tests."""
    monkeypatch.setattr("gonio.formats.rgl.layout.SIZE", 16)
    monkeypatch.setattr("gonio.formats.radiance.patch_means.RING_STEPS", ((2, 60),))
    monkeypatch.setattr("gonio.formats.radiance.patch_means.PAIR_STEPS", (1,))


@pytest.fixture
def coarse_tables(coarse_grids, monkeypatch):
    """Tables of a few hundred values in every format, too coarse for what lies between the directions of a scan."""
    monkeypatch.setattr("gonio.formats.hemispheres.STEPS", (30.0,))
    monkeypatch.setattr("gonio.formats.mirror_grid.AZIMUTH_STEP", 45.0)
    monkeypatch.setattr("gonio.formats.mirror_grid.NARROWEST", 15.0)
    monkeypatch.setattr("gonio.formats.mirror_grid.WIDEST", 30.0)
    monkeypatch.setattr("gonio.formats.zemax.RADIAL", (0, 5, 15, 30, 60, 90, 120, 160))
    monkeypatch.setattr("gonio.formats.zemax.STEP", 45.0)


@pytest.fixture(scope="module")
def quick_compilation():
    """Compilation takes most of the time of small stacks, and optimised code none of what is promised."""
    jax = pytest.importorskip("jax", reason="the extra `batch` is not installed")
    jax.config.update("jax_disable_most_optimizations", True)
    yield
    jax.config.update("jax_disable_most_optimizations", False)


@pytest.fixture
def aluminium():
    """The paper's aluminium: model, constants at three incidence angles, and a noisy simulated scan."""
    constants = published["Al"]
    angles = [30.0, 40.0, 50.0]
    values = {k: {a: v[a] for a in angles} if isinstance(v, dict) else v for k, v in constants.values.items()}
    model = catalogue[constants.model]
    scan = simulate(model, values, angles, np.arange(-80, 81, 2.0), noise=0.01, seed=1, unit="a.u.")
    return model, values, scan


@pytest.fixture(scope="session")
def shared_cases() -> Path:
    """Small inputs that once failed, each in a folder with a README; a test is skipped where they are absent."""
    folder = SHARED_SCANS.parents[1] / "cases" / "files"
    if not folder.is_dir():
        pytest.skip(f"no cases at {folder}")
    return folder


@pytest.fixture(scope="module")
def chromium():
    """A browser, which is closed before a test of another folder that does not ask for it: see `Shared.close`."""
    return shared.browser()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> Iterator[None]:
    yield
    is_near = nextitem is not None and nextitem.path.parent == item.path.parent
    if not is_near and "chromium" not in getattr(nextitem, "fixturenames", ()):
        shared.close()
