"""Drivers are imported only when a bench names them, and what they need is said."""

import subprocess
import sys

import pytest

from gonio.acquisition.drivers import DRIVERS, driver


def test_measuring_imports_no_driver_and_draws_nothing():
    code = (
        "import sys, gonio.acquisition; print([m for m in sys.modules if m in ('pymeasure', 'bluesky', 'matplotlib')])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_package_that_is_missing_is_named_with_its_remedy(monkeypatch, tmp_path):
    monkeypatch.delitem(sys.modules, "gonio.acquisition.drivers.pymeasure", raising=False)
    for name in ("pymeasure", "pymeasure.instruments"):
        monkeypatch.setitem(sys.modules, name, None)
    with pytest.raises(ValueError, match=r"the driver 'pm100' needs pymeasure.*: pip install 'gonio\[instruments\]'"):
        driver("pm100", tmp_path)


@pytest.mark.parametrize("name", sorted(DRIVERS))
def test_every_driver_of_the_list_is_there(name, tmp_path):
    if "pymeasure" in DRIVERS[name]:
        pytest.importorskip("pymeasure", reason="the extra `instruments` is not installed")
    assert isinstance(driver(name, tmp_path), type)
