"""Direct-hemispherical values by Radiance's library and by pyWinCalc of the Klems files that gonio writes.

    python tests/crosscheck/klems_peer.py FOLDER     writes tests/reference/peers/klems.json

FOLDER is what klems_files.py wrote. Knows nothing of gonio: patches are those of pyWinCalc, and gonio's values, which
klems_files.py left there, are only copied beside the peers'. Radiance reads Visible alone. Its z axis points to the
back, and both programs take the azimuth of an incident patch as that to which the light travels. PyWinCalc takes the
matrices that it reads one side at a time; the one file with all that a glazing system needs is one, too.
"""

import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pyradiance
import pywincalc
from peers import write

SIDES = {"Front": pywincalc.Side.Front, "Back": pywincalc.Side.Back}
MODES = {"Reflection": "reflectance", "Transmission": "transmittance"}
FULL = pywincalc.BSDFHemisphere.create(pywincalc.BSDFBasisType.FULL)
BANDS = (0, 10, 20, 30, 40, 50, 60, 70, 82.5)  # Klems Full: polar angles of the centres [deg] and patches in each band
COUNTS = (1, 8, 16, 20, 24, 24, 24, 16, 12)


def centres():
    """Polar angle and azimuth [deg] of each incident patch."""
    return [(theta, 360 * k / n) for theta, n in zip(BANDS, COUNTS, strict=True) for k in range(n)]


def rounded(values):
    return [float(f"{v:.7g}") for v in values]


def radiance(path, name):
    """The values of one block, in a process of its own: the library is not made to load a second file."""
    command = [sys.executable, __file__, str(path), name]
    found = subprocess.run(command, capture_output=True, check=True, text=True, timeout=60)
    return json.loads(found.stdout)


def query(path, name):
    _, mode, side = name.split()
    data = pyradiance.bsdf.load_file(path)
    kind = {"Reflection": pyradiance.bsdf.SAMPLE_R, "Transmission": pyradiance.bsdf.SAMPLE_T}[mode]
    kind |= pyradiance.bsdf.SAMPLE_SP | pyradiance.bsdf.SAMPLE_DF
    found = []
    for theta, azimuth in centres():
        # Radiance's vectors lead to the source: from the front below its horizon, opposite to where the light travels.
        polar = 180 - theta if side == "Front" else theta
        found.append(pyradiance.bsdf.direct_hemi(data, float(polar), float((azimuth + 180) % 360), kind))
    return rounded(found)


def wincalc(product, name):
    """The same by pyWinCalc's integrator."""
    channel, mode, side = name.split()
    bsdfs = getattr(product.measurements, channel.lower())
    data = getattr(bsdfs, f"{MODES[mode]}_{side.lower()}").data
    zero = np.zeros_like(data).tolist()
    matrices = [data, zero] if mode == "Transmission" else [zero, data]
    integrator = pywincalc.BSDFIntegrator(FULL.get_directions(pywincalc.BSDFDirection.Incoming))
    integrator.set_matrices(*map(pywincalc.SquareMatrix, matrices), SIDES[side])
    kind = {"Reflection": pywincalc.PropertySimple.R, "Transmission": pywincalc.PropertySimple.T}[mode]
    return rounded(integrator.direct_hemispheric(SIDES[side], kind))


def glazing(product):
    """Values by block of a glazing system of this one layer, from the matrices that it computes in half a minute."""
    system = pywincalc.GlazingSystem(solid_layers=[product], bsdf_hemisphere=FULL)
    projected = FULL.get_directions(pywincalc.BSDFDirection.Incoming).lambda_vector()
    found = {}
    for channel, method in (("Visible", "PHOTOPIC"), ("Solar", "SOLAR")):
        results = system.optical_method_results(method, 0, 0).system_results
        for mode, quantity in MODES.items():
            for side in SIDES:
                result = getattr(getattr(results, side.lower()), quantity)
                ways = projected @ np.array(result.matrix)
                assert abs(ways[0] - result.direct_hemispherical) < 1e-12
                found[f"{channel} {mode} {side}"] = rounded(ways)
    return found


def main(folder):
    own = json.loads((folder / "gonio.json").read_text(encoding="utf-8"))
    columns, surfaces = {}, {}
    for scan, values in own.items():
        path = str(folder / f"{scan}.xml")
        product = pywincalc.parse_bsdf_xml_file(path)
        for name in values["file"]:
            columns[f"{scan} | {name} | gonio"] = rounded(values["file"][name])
            columns[f"{scan} | {name} | pywincalc"] = wincalc(product, name)
            if name.startswith("Visible"):
                columns[f"{scan} | {name} | radiance"] = radiance(path, name)
        if len(values["file"]) == 2 * len(MODES) * len(SIDES):
            columns |= {f"{scan} | {name} | glazing system": found for name, found in glazing(product).items()}
        surfaces[scan] = {"gonio convert": values["options"], "blocks": list(values["file"])}
    write(
        "klems.json",
        {
            "peers": {name: version(name) for name in ("pyradiance", "pywincalc")},
            "command": "make crosscheck",
            "value": "direct-hemispherical reflectance or transmittance of each incident patch of Klems Full, in order",
            "gonio": "the sum over outgoing patches of value times projected solid angle, as gonio reads the file",
        },
        columns,
        surfaces,
    )


if __name__ == "__main__":
    if len(sys.argv) > 2:
        print(json.dumps(query(*sys.argv[1:])))
    else:
        main(Path(sys.argv[1]))
