"""Every example of every `--help` runs as it stands, in a folder with small files of the names that it uses."""

import math
import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
import typer

import height_files
from gonio import Problem, catalogue, convert, fit, join, simulate, write
from gonio.acquisition import Conditions, Layout, grid, planned, read_bench
from gonio.acquisition.simulated import Mirror
from gonio.app.program import COMMANDS, EXAMPLES, app
from gonio.resampling.resample import Filling
from gonio.resampling.sources import SYMMETRIES
from gonio.topography import simulate_heights
from simulated_benches import bench_of, measure
from stacks import one_after_another, only_here, write_stack

PROGRAM = typer.main.get_command(app)
LINES = [
    pytest.param(one.line, id=one.line)
    for name in COMMANDS
    for one in PROGRAM.get_command(PROGRAM.make_context("gonio", [], resilient_parsing=True), name).examples
]
ANGLES = [10.0, 30.0, 50.0]
SEEN = "sun_altitude_deg,sun_azimuth_deg,altitude_deg,azimuth_deg,height_km\n-5,90,40,100,550\n-5,90,60,120,550\n"
CONSTANTS = "DATA:\n  - type: tabulated nk\n    data: |\n      0.5 1.5 0.0\n      0.6 1.6 0.1\n"


def painted(seed, sets=(550.0, 650.0), **values):
    """A scan of a coating at some wavelengths, with noise of a hundredth."""
    given = {"rho_s": 0.2, "rho_d": 0.1, "width": 0.3} | values
    theta_r = np.arange(-70, 71, 10.0)
    scans = [
        simulate(catalogue["ggx"], given, ANGLES, theta_r, noise=0.01, seed=seed + k, wavelength=one)
        for k, one in enumerate(sets)
    ]
    return join({str(k): scan for k, scan in enumerate(scans)}).drop_vars("scan") if len(scans) > 1 else scans[0]


def measuring(folder):
    """A plan, benches that are computed, and the journals of two measurements."""
    bench = '[simulated]\nmodel = "ggx"\nvalues = {rho_s = 0.2, rho_d = 0.1, width = 0.3}\n'
    for name in ("bench", "trial"):
        (folder / f"{name}.toml").write_text(bench)
    plan = grid([30], [0, 30, 60])
    plan.write(folder / "plan.toml")
    measure(folder / "run.jsonl", read_bench(folder / "bench.toml", plan.conditions, catalogue.__getitem__), plan)
    conditions = Conditions(wavelength=632.8, polarisation="s", filter="nd")
    mirrored = planned([(30, 30, None), (60, 60, None)], Layout(incident=True), conditions)
    measure(folder / "mirror.jsonl", bench_of(Mirror(1.37, 7.62, "s"), (1e-5, 2e-3)), mirrored)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """The files that the examples name; those that they write are not there."""
    folder = tmp_path_factory.mktemp("examples")
    scan = painted(1, sets=(650.0,))
    write(scan, folder / "scan.csv")
    for seed, name in enumerate(("a", "b")):
        write(painted(10 * seed), folder / f"{name}.csv")
    for seed, name in enumerate(("one", "two", "before", "after")):
        write(painted(100 + seed, sets=(650.0,)), folder / f"{name}.csv")
    (folder / "wafers").mkdir()
    (folder / "directions.csv").write_text("theta_i_deg,theta_r_deg,phi_deg\n20,40,0\n20,40,150\n35,35,180\n")
    for k in (1, 2, 10):
        write(painted(300 + k, sets=(650.0,)), folder / "wafers" / f"wafer{k}.csv")
    write(painted(200, sets=(650.0,), rho_s=0.0, rho_d=0.001), folder / "blank.csv")
    polarised = {"ks": 0.4, "kd": 0.02, "sigma": 0.2, "index": 1.5, "extinction": 0.0}
    model = catalogue["priest-mueller"]
    states = simulate(model, polarised, [30.0, 60.0], np.arange(-70, 71, 20.0), noise=0.01, polarisation=("s", "p"))
    write(states, folder / "polarised.csv")
    smooth = fit(Problem(catalogue["lambert"], scan))
    convert(scan, folder / "coating.bsdf", to="zemax", filling=Filling(SYMMETRIES, smooth.predict, "lambert"))
    (folder / "results").mkdir()
    smooth.save(folder / "results" / "solution.nc")
    (folder / "coating.yml").write_text(CONSTANTS)
    fit(Problem(catalogue["torrance-sparrow"], scan)).save(folder / "fit.nc")
    z = simulate_heights(0.3, 3.0, points=(100, 100), pitch=0.5)["z"].values
    height_files.npy(folder / "map.npy", z)
    height_files.sdf_text(folder / "map.sdf", z)
    (folder / "about.yml").write_text("sample: {name: panel 7, manufacturer: A. Painter}")
    rows = [f"{i},{r},{0.1 + i / 1000}" for i in (10, 30) for r in (-20, 0, 20, 40)]
    (folder / "table.csv").write_text("\n".join(["AOI [deg],AOS [deg],BRDF [1/sr]", *rows]))
    measuring(folder)
    directions = [(i, r) for i in (20, 40) for r in range(-60, 61, 10)]
    signals = [f"sample,{i},{r},{0.002 + 0.02 * math.cos(math.radians(r)):.6f},2e-5" for i, r in directions]
    others = ["dark,,,0.002,1e-5", "standard,0,45,0.0702,2e-5", "incident,,,0.3,2e-5"]
    (folder / "run.csv").write_text("\n".join(["kind,theta_i_deg,theta_r_deg,signal_V,sd_V", *others, *signals]))
    (folder / "panel.csv").write_text("theta_i_deg,theta_r_deg,brdf_sr-1\n0,45,0.315")
    facet = '[[facet]]\narea = 3.6\nnormal = [0, 0, -1]\nfit = "results/solution.nc"\n'
    (folder / "satellite.toml").write_text(facet)
    (folder / "pass.csv").write_text(SEEN)
    (folder / "lab.csv").write_text("\n".join(["AOI,AOS,BSDF", *rows]))
    return folder


@pytest.fixture
def here(files, tmp_path, monkeypatch):
    """A copy of the files, where the command runs."""
    shutil.copytree(files, tmp_path, dirs_exist_ok=True)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def alone(monkeypatch):
    """No network, no cluster, a study of one page, a catalogue of two models, and a server that ends at once.

    Other tests have them whole.
    """
    few = [catalogue["lambert"], catalogue["ggx"]]
    monkeypatch.setattr("gonio.comparison.answer.everything", lambda: few)
    monkeypatch.setattr("gonio.app.commands.fetch.fetch", lambda *_: Path("scan.csv"))
    monkeypatch.setattr("gonio.app.commands.demo.write_demo", _page)
    monkeypatch.setattr(
        "gonio.viewing.serving.running.serve", lambda _session, _serving, ready, _tell: ready("http://")
    )
    monkeypatch.setattr("typer.launch", lambda _address: 0)


def _page(folder, seed, force, progress):
    progress(1.0)
    folder.mkdir(exist_ok=force)
    (folder / "index.html").write_text(f"seed {seed}")
    return folder / "index.html"


def prepare(line, folder, monkeypatch, run):
    """What must be there before an example: an earlier one's output where it says --force, a stack, fits of one."""
    command = line.split()[1]
    if "albedo fits.zarr" in line:
        prepare("gonio fit-stack", folder, monkeypatch, run)
        assert run("fit-stack", "stack.zarr", "--model", "lambert", "--out", "fits.zarr")[0] == 0
    elif command == "fit-stack":
        pytest.importorskip("distributed", reason="the extra `cluster` is not installed")
        monkeypatch.setattr("gonio.fitting.stack.cluster.connected", only_here)
        monkeypatch.setattr("gonio.fitting.stack.cluster.fit_blocks", one_after_another)
        write_stack(folder / "stack.zarr", {"sample": 4})
    elif command == "fit":
        shutil.rmtree(folder / "results")
    elif " coating.bsdf --to" in line:
        (folder / "coating.bsdf").unlink()
    elif command == "measure":
        (folder / "run.jsonl").unlink()
    elif command in ("reduce", "import"):
        (folder / "scan.csv").unlink()


@pytest.mark.parametrize("line", LINES)
def test_an_example_runs_as_it_stands(run, here, alone, monkeypatch, line):
    prepare(line, here, monkeypatch, run)
    words = shlex.split(line)
    assert words[0] == "gonio"
    before = set(here.rglob("*"))
    code, out, err = run(*words[1:])
    assert code == 0, err
    assert out
    writes = [words[words.index(flag) + 1] for flag in ("--out", "--json") if flag in words]
    assert all(any(path.name.startswith(Path(name).stem) for path in here.iterdir()) for name in writes if name != "-")
    if words[1] in ("plot", "draw", "convert", "reduce", "demo", "measure", "watch"):
        assert set(here.rglob("*")) - before


@pytest.mark.parametrize("line", [one.line for one in EXAMPLES])
@pytest.mark.usefixtures("alone")
def test_the_examples_of_the_program_run(run, here, line):
    shutil.rmtree(here / "results")
    if line.startswith("gonio import"):
        (here / "scan.csv").unlink()
    code, out, err = run(*shlex.split(line)[1:])
    assert code == 0, err
    assert out
