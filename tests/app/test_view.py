"""`gonio view` on the command line: what it refuses, what it loads, and what its page weighs."""

import json
import resource
import socket
import subprocess
import sys

import numpy as np
import pytest

from gonio import Problem, catalogue, fit, simulate, write
from gonio.measured.check import Finding, Severity
from gonio.viewing.assembled import parts

HEAVY = ("matplotlib", "scipy.optimize", "scipy.stats", "jax", "distributed", "gonio.reporting")
STARTED = 6.0  # s of a processor, of which a quiet machine needs a quarter


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    scan = simulate(catalogue["lambert"], {"rho": 0.3}, [0.0, 45.0], np.arange(-60.0, 61, 10), noise=0.01, seed=1)
    write(scan, "scan.csv")
    write(scan.assign(mask=("direction", np.full(scan.sizes["direction"], 4, dtype=np.uint8))), "masked.nc")
    fit(Problem(catalogue["lambert"], scan)).save("fit.nc")
    degrees = simulate(
        catalogue["priest-mueller"],
        {"ks": 0.6, "kd": 0.02, "sigma": 0.2, "index": 1.5, "extinction": 0.0},
        [30.0],
        np.arange(-60.0, 61, 10),
        offset_noise=0.005,
        seed=3,
        polarisation=">q/i",
    )
    write(degrees, "dolp.csv")
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ("missing.csv", "missing.csv: there is no such file"),
        ("scan.csv --model ggxx", "ggxx: there is no such model; nearest: ggx"),
        ("scan.csv --solution scan.csv", "scan.csv: holds no fit: give what gonio fit --out writes"),
        ("scan.csv --diff", "--diff compares two files: name both"),
        ("scan.csv --out page.pdf", "page.pdf: the page is HTML: give a name that ends in .html"),
        ("scan.csv --out nowhere/page.html", "nowhere"),
        ("masked.nc", "no value is in use: every value is masked or missing: loosen the masks"),
        ("dolp.csv", "dolp.csv: degrees of polarisation are no BRDF, which the page shows: gonio plot draws them"),
        ("scan.csv --model lambert --set colour=3", "lambert has no parameter 'colour'; it has rho"),
        ("scan.csv --model lambert --set rho=-1", "rho is -1: lambert takes 0 to inf"),
        ("scan.csv --port 70000", "port"),
    ],
)
def test_refusals_are_one_line_with_the_remedy(run, here, arguments, said):
    code, out, err = run("view", *arguments.split(), "--no-browser")
    assert code in (1, 2)
    assert out == ""
    *warnings, refusal = err.splitlines()
    assert all(": warning: " in line for line in warnings)
    assert said in refusal
    assert "mistake in gonio" not in err


def test_a_port_in_use_is_told(run, here):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        code, out, err = run("view", "scan.csv", "--no-browser", "--port", port)
    assert (code, out) == (1, "")
    assert (
        err == f"gonio: port {port} of 127.0.0.1: Address already in use: choose another by --port, or leave it out\n"
    )


def test_it_starts_without_what_a_first_curve_does_not_need(here):
    """From the start of the program to all that its page needs, in seconds of a processor: others may be busy."""
    code = (
        "import json, sys; sys.argv = ['gonio', 'view', 'scan.csv', '--set', 'width=0.1', '--out', 'page.html']\n"
        "from gonio.app.cli import main\n"
        "try: main()\nexcept SystemExit: pass\n"
        f"print(json.dumps([m for m in {HEAVY!r} if m in sys.modules]))"
    )
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=here)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    assert json.loads(done.stdout.splitlines()[-1]) == []
    seconds = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    print(f"{seconds:.2f} s of a processor")
    assert seconds < STARTED


def test_a_first_curve_needs_no_scipy(here):
    """Its import would take a quarter of the time until the curve is seen."""
    code = (
        "import json, sys\n"
        "sys.modules['dask'] = None  # xarray imports it where it is, and that imports SciPy\n"
        "import gonio, gonio.viewing.serving.running\n"
        "from gonio.viewing.session import Opened, Session\n"
        "session = Session([Opened('scan', gonio.read('scan.csv'))])\n"
        "session.refuse_unshown(); session.described(); session.prepare()\n"
        "print(json.dumps('scipy' in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=here)
    assert json.loads(done.stdout) is False


def test_a_table_is_checked_when_its_page_asks(run, here, monkeypatch):
    """Of a million values that takes longer than the page; a scan is checked before, and its errors end the program."""
    begun = []

    def checked(scan, table=()):
        begun.append("checked")
        return [Finding(Severity.WARNING, "something is wrong", "mend it", name="wrong")]

    def served(session, *_):
        begun.append("served")
        assert len(session.opened[0].findings) == 1

    monkeypatch.setattr("gonio.findings.registry.check", checked)
    monkeypatch.setattr("gonio.viewing.serving.running.serve", served)
    size = (30, 15, 12)
    numbers = np.full((3, *size), 100.0)
    (here / "table.binary").write_bytes(np.array(size, "<i4").tobytes() + numbers.tobytes())
    for name, order in {"table.binary": ["served", "checked"], "scan.csv": ["checked", "served"]}.items():
        begun.clear()
        code, _, err = run("view", name, "--no-browser")
        assert (code, begun) == (0, order)
        assert name in err
        assert err.count("something is wrong") == 1


def test_a_page_in_one_file_holds_a_fit(run, here, monkeypatch):
    """Of the model that it begins with, unless values are given; what exists is refused before the fit."""
    assert run("view", "scan.csv", "--model", "lambert", "--out", "page.html")[:2] == (0, "wrote page.html\n")
    assert '"status": "converged"' in (here / "page.html").read_text(encoding="utf-8")
    assert run("view", "scan.csv", "--model", "lambert", "--set", "rho=0.2", "--out", "given.html")[0] == 0
    assert '"status": "converged"' not in (here / "given.html").read_text(encoding="utf-8")
    monkeypatch.setattr("gonio.viewing.working.beginning.fit", None)
    code, _, err = run("view", "scan.csv", "--model", "lambert", "--out", "page.html")
    assert (code, "page.html" in err) == (1, True)


def test_a_scan_that_cannot_be_fitted_is_shown_with_a_word(run, here, monkeypatch):
    def refused(*_, **__):
        raise ValueError("there is nothing to fit")

    monkeypatch.setattr("gonio.viewing.working.beginning.fit", refused)
    code, out, err = run("view", "scan.csv", "--model", "lambert", "--out", "page.html")
    assert (code, out) == (0, "wrote page.html\n")
    assert err == (
        "gonio: warning: scan.csv: lambert was not fitted, so that the page begins at its defaults: "
        "there is nothing to fit\n"
    )


def test_the_page_is_small():
    """What developers write, and what the libraries weigh: a page that opens at once, also in one file."""
    own = {name: len(text) for name, text in parts().items() if not name.startswith("vendor/")}
    vendor = sum(len(text) for name, text in parts().items() if name.startswith("vendor/"))
    assert sum(own.values()) < 220_000
    assert sum(own.values()) + vendor < 400_000


def test_every_library_of_the_page_brings_its_licence():
    from importlib.resources import files

    folder = files("gonio.viewing").joinpath("page", "vendor")
    names = {one.name for one in folder.iterdir()}
    libraries = {name.removesuffix(".js") for name in names if name.endswith(".js")}
    assert libraries == {name.removesuffix(".LICENSE") for name in names if name.endswith(".LICENSE")}
