"""The scatter DLL of OpticStudio: compiled here, called many times, and held to the model and to its own density."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest

import gonio
from crosscheck.zemax_dll import MODELS as VALUES
from crosscheck.zemax_dll import compared, isotropic, specular
from gonio import Geometry, Model, catalogue
from gonio.exporting.entry import write
from gonio.exporting.mixture import mixture
from gonio.exporting.subject import of_model
from gonio.exporting.targets.c import compiled, compiler
from gonio.exporting.targets.zemax import SIZE, scattered

needs_compiler = pytest.mark.skipif(not compiler(), reason="no C compiler is installed")
WINDOWS = shutil.which("x86_64-w64-mingw32-gcc")
N = 30_000
# A false alarm in a thousand runs, were the seeds not fixed.
LEVEL = 1e-3
# A lobe with a sampler of its own, one that loses light below the horizon, several lobes, and a term without a sampler.
MODELS = {name: VALUES[name] for name in ("ggx", "harvey-shack", "gonio-best", "rpv")}
each_model = pytest.mark.parametrize("name", MODELS)


def written(tmp_path, name, values):
    return gonio.export(catalogue[name], tmp_path / "coating_zemax.c", to="zemax-dll", values=values)


def library_of(tmp_path, name, values):
    return compiled(compiler(), written(tmp_path, name, values).files[0], tmp_path / "coating.so")


@needs_compiler
@each_model
@pytest.mark.parametrize("theta_i", [10.0, 60.0])
def test_the_mean_energy_is_the_reflectance_and_directions_follow_the_density(name, theta_i, tmp_path):
    library = library_of(tmp_path, name, MODELS[name])
    found = compared(name, MODELS[name], library, theta_i, N)
    assert abs(found["mean energy"] - found["reflectance"]) < 3 * found["standard error"]
    assert found["p"] > LEVEL


@needs_compiler
@each_model
def test_the_check_of_the_command_holds(name, tmp_path):
    proof = written(tmp_path, name, MODELS[name]).prove()
    assert proof.holds
    assert "lost" in proof.how


@needs_compiler
@pytest.mark.parametrize("flipped", [False, True])
def test_a_surface_may_lie_in_any_way(flipped, tmp_path):
    """The same energies in another frame, whichever side the normal points to."""
    name, values = "ggx", MODELS["ggx"]
    subject = of_model(catalogue[name], values)
    library = library_of(tmp_path, name, values)
    rng = np.random.default_rng(3)
    run = ctypes.CDLL(str(library)).UserScatterDefinition
    pairs, energies = [], []
    for k in range(200):
        n, s = rng.standard_normal((2, 3))
        n[2] = -1.0 if k == 0 else n[2]  # the frame has its seam there
        n[:2] = 0.0 if k == 0 else n[:2]
        n, s = n / np.linalg.norm(n), s / np.linalg.norm(s)
        s = s if n @ s > 0 else -s
        data = np.zeros(SIZE)
        data[4:7], data[7:10], data[16] = s, -n if flipped else n, k
        run(ctypes.c_void_p(data.ctypes.data))
        out, energy = data[4:7], data[12]
        assert np.linalg.norm(out) == pytest.approx(1)
        along = np.cross(n, [1.0, 0, 0] if abs(n[0]) < 0.5 else [0, 1.0, 0])
        along /= np.linalg.norm(along)
        frame = np.stack([along, np.cross(n, along), n])
        if energy > 0:
            pairs.append([*(frame @ (2 * (n @ s) * n - s)), *(frame @ out)])
            energies.append(energy)
    g = Geometry(*np.array(pairs).T)
    expected = subject.brdf(g) * g.z_r / mixture(subject).density(g)
    assert len(energies) > 150
    assert np.array(energies) == pytest.approx(np.asarray(expected), rel=1e-9)


@needs_compiler
def test_calls_depend_on_the_seed_and_on_nothing_else(tmp_path):
    library = library_of(tmp_path, "lambert", {"rho": 0.5})
    rays = np.tile(specular(40.0), (3, 1))
    first, second = (scattered(library, rays, np.array([1.0, 2.0, 1.0]))[0] for _ in range(2))
    assert np.array_equal(first, second)
    assert np.array_equal(first[0], first[2])
    assert not np.allclose(first[0], first[1])


@needs_compiler
def test_a_lambertian_comes_back(tmp_path):
    """Every ray of an ideal diffuse surface has the energy of its reflectance: 0.5/pi cos over cos/pi."""
    library = library_of(tmp_path, "lambert", {"rho": 0.5})
    directions, energies = scattered(library, np.tile(specular(40.0), (1000, 1)), np.arange(1000.0))
    assert energies == pytest.approx(0.5)
    assert directions[:, 2].mean() == pytest.approx(2 / 3, abs=0.03)  # mean cosine of the cosine law, 1000 draws


@needs_compiler
def test_the_dialog_has_no_parameters(tmp_path):
    name = ctypes.create_string_buffer(b"1", 100)
    assert ctypes.CDLL(str(library_of(tmp_path, "lambert", {"rho": 0.5}))).UserParamNames(name) == 0
    assert name.value == b""


@pytest.mark.skipif(not WINDOWS, reason="no compiler for Windows is installed (gcc-mingw-w64-x86-64)")
def test_windows_exports_both_functions(tmp_path):
    done = written(tmp_path, "ggx", MODELS["ggx"])
    command = [WINDOWS, "-std=c99", "-Wall", "-Wextra", "-Werror", "-O2", "-shared", "-static-libgcc"]
    dll = tmp_path / "coating.dll"
    subprocess.run([*command, "-o", str(dll), str(done.files[0])], check=True)
    assert all(name in dll.read_bytes() for name in (b"UserScatterDefinition", b"UserParamNames"))


def test_the_file_says_how_to_compile_it_and_what_is_not_verified(tmp_path):
    done = written(tmp_path, "ggx", MODELS["ggx"])
    text = done.files[0].read_text()
    assert "x86_64-w64-mingw32-gcc -O2 -shared -static-libgcc -o coating_zemax.dll coating_zemax.c" in text
    assert "outside OpticStudio" in text
    assert any("outside OpticStudio" in remark for remark in done.remarks)
    assert done.numbers["largest_relative_energy"] > 0


@needs_compiler
def test_text_from_outside_neither_ends_the_comment_nor_begins_another(tmp_path):
    subject = of_model(catalogue["lambert"], {"rho": 0.5}, origin="*/ int x; /* a // b \\ \n int y;")
    done = write(subject, tmp_path / "x*:y.c", "zemax-dll")
    compiled(compiler(), done.files[0], tmp_path / "x.so")


@pytest.mark.parametrize("name", catalogue)
def test_every_model_goes_out(tmp_path, name):
    """Also one whose density takes special functions of its parameters, which are plain numbers here."""
    assert "scatter" in written(tmp_path, name, isotropic(catalogue[name])).files[0].read_text(encoding="utf-8")


def test_a_brushed_surface_is_refused(tmp_path):
    brushed = Model.from_function(lambda g, width: np.exp(-((g.x_r / width) ** 2)), {"width": (0.1, 1.0)})
    with pytest.raises(ValueError, match="turned"):
        write(of_model(brushed, {"scale": 0.1}), tmp_path / "x.c", "zemax-dll")


def test_negative_values_and_a_surplus_are_told(tmp_path):
    negative = written(tmp_path, "ross-li", {"fiso": 0.1, "fvol": 0.2, "fgeo": 0.05})
    assert any("negative" in remark for remark in negative.remarks)
    (tmp_path / "coating_zemax.c").unlink()
    surplus = written(tmp_path, "lambert", {"rho": 1.5})
    assert any("more than it gets" in remark for remark in surplus.remarks)
