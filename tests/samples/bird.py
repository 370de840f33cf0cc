"""Small valid BiRD documents, but for the metadata that the reader does not ask for."""

import json
from pathlib import Path
from typing import Any

METADATA = {
    "schema": "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/BRDF_JSON_schema/brdf_json_schema_v1.0.json",
    "type": "BRDF",
    "description": "a sample, ünpolished",
    "method": "measurement",
    "sample": {
        "name": "S1",
        "properties_symmetry": "anisotropic",
        "dimensions": {"length": {"value": 50, "unit": "mm"}},
    },
}


def plain() -> dict[str, Any]:
    """Four directions in radians and degrees, percent uncertainties, both wavelengths and polarisations."""
    return {
        "metadata": METADATA,
        "data": {
            "wavelength_i": {"unit": "μm", "values": [0.55, 0.55, 0.65, 0.65]},
            "wavelength_r": {"unit": "nm", "values": [550, 600, 650, 700]},
            "polarization_i": {"notation": "sp", "values": ["s", "p", "u", "s"]},
            "polarization_r": {
                "notation": "inStokes",
                "values": [[1, 1, 0, 0], [1, -1, 0, 0], [1, 0, 0, 0], [1, 0.5, 0.25, 0]],
            },
            "theta_i": {"unit": "deg", "values": [0, 30, 30, 60]},
            "phi_i": {"unit": "°", "values": [0, 10, 350, 90]},
            "theta_r": {"unit": "rad", "values": [0.0, 0.5, 1.0, 1.5]},
            "phi_r": {"unit": "°", "values": [180, 190, 10, 0]},
            "BRDF": {"unit": "1/sr", "values": [0.25, 0.5, 1e-7, 12]},
            "uBRDF": {"unit": "%", "values": [1, 2, 50, 0.5]},
            "adhoc_variables": {
                "temperature": {"description": "air", "unit": "K", "type": "number", "values": [293, 293.5, 294, 295]},
                "channel": {"description": "band", "unit": "", "type": "string", "values": ["R", "G", "B", "R"]},
            },
        },
    }


def shortest() -> dict[str, Any]:
    """Only what must be there, and an uncertainty for all values."""
    brdf = {"unit": "sr^-1", "values": [0.1, 0.2], "uncertainty": {"value": 0.01, "unit": "sr^-1"}}
    angles = {name: {"unit": "°", "values": [10, 20]} for name in ("theta_i", "phi_i", "theta_r", "phi_r")}
    return {"metadata": METADATA, "data": {**angles, "BRDF": brdf}}


def samples(folder: Path) -> list[Path]:
    found = [folder / "bird_plain.brdf", folder / "bird_shortest.brdf"]
    for path, document in zip(found, (plain(), shortest()), strict=True):
        path.write_text(json.dumps(document, indent=1, ensure_ascii=False), encoding="utf-8")
    return found
