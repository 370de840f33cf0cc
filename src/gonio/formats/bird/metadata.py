"""The metadata of a BiRD file: sample, instrument, environment and so on, as the format's JSON schema lists them.

They become lines of provenance, and are kept in full as an attribute of the scan, so that they can be written again. A
scan from elsewhere gets metadata whose required entries say that they are unknown.
"""

import hashlib
import json
import uuid
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import xarray as xr

from gonio.door.json_text import Document

METADATA = "bird_metadata"  # attribute of a scan: the metadata of the file as JSON
_SECTION = "gonio"  # name of gonio's adhoc section, which holds provenance and history
SCHEMA = "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/BRDF_JSON_schema/brdf_json_schema_v1.0.json"
UNKNOWN = "unknown"
_PLACE = dict.fromkeys(("country", "city", "street", "building_nr", "postal_code"), UNKNOWN)


def attributes(document: Document) -> dict[str, str]:
    """The attributes of a scan: provenance, history, symmetry, and the metadata of the file in full."""
    metadata = document.object("metadata")
    section = metadata.get("adhoc_section")
    gonio_section = section.get(_SECTION) if isinstance(section, dict) else None
    gonio_section = gonio_section if isinstance(gonio_section, dict) else {}
    original = {k: v for k, v in metadata.items() if k != "adhoc_section" or v != {_SECTION: gonio_section}}
    texts = {"provenance": gonio_section.get("provenance"), "history": gonio_section.get("history")}
    attrs = {name: text if isinstance(text, str) else "" for name, text in texts.items()}
    if not isinstance(texts["provenance"], str):
        attrs["provenance"] = "\n".join(lines(original))
    if not gonio_section.get("made_up"):
        attrs[METADATA] = json.dumps(original, ensure_ascii=False)
    sample = metadata.get("sample")
    symmetry = sample.get("properties_symmetry") if isinstance(sample, dict) else None
    if symmetry in ("isotropic", "anisotropic"):
        attrs["symmetry"] = symmetry
    return attrs


def lines(metadata: Any) -> Iterator[str]:
    """A line such as `sample.name: SRT1` for every value, in the order of the file; found without recursion."""
    waiting: list[tuple[str, Any]] = [("", metadata)]
    while waiting:
        name, value = waiting.pop()
        if isinstance(value, dict):
            waiting += [(f"{name}.{k}" if name else k, v) for k, v in reversed(value.items())]
        elif isinstance(value, list):
            waiting += [(name, v) for v in reversed(value)]
        elif value is not None:
            text = f"{value:.17g}" if isinstance(value, float) else " ".join(str(value).split())
            yield f"{' '.join(name.split())}: {text}"


def metadata(scan: xr.Dataset) -> dict[str, Any]:
    """The metadata to write: those with which the scan was read, else defaults that say what is unknown."""
    gonio_section = {name: str(scan.attrs[name]) for name in ("history", "provenance") if scan.attrs.get(name)}
    try:
        original = json.loads(scan.attrs[METADATA])
    except (KeyError, ValueError):
        original = None
    if not isinstance(original, dict):
        return _default_metadata(
            scan, gonio_section | {"provenance": gonio_section.get("provenance", ""), "made_up": True}
        )
    section = original.get("adhoc_section")
    if gonio_section.get("provenance") == "\n".join(lines(original)):
        del gonio_section["provenance"]
    return original | {"adhoc_section": (section if isinstance(section, dict) else {}) | {_SECTION: gonio_section}}


def _default_metadata(scan: xr.Dataset, gonio_section: dict[str, Any]) -> dict[str, Any]:
    content = hashlib.sha256(scan["brdf"].values.tobytes()).hexdigest()
    symmetry = scan.attrs.get("symmetry")
    return {
        "schema": SCHEMA,
        "id": f"urn:uuid:{uuid.uuid5(uuid.NAMESPACE_OID, content)}",
        "type": "BRDF",
        "timestamp": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        "provenance": {
            "organization": UNKNOWN,
            "location": _PLACE,
            "email": "unknown@unknown.invalid",
            "contact_person": UNKNOWN,
        },
        "description": gonio_section["provenance"].partition("\n")[0] or "BRDF written by gonio",
        "method": "simulation" if "simulated" in scan.attrs else "measurement",
        "instrumentation": "NA",
        "software": {"name": "gonio"},
        "sample": {
            "name": UNKNOWN,
            "type": UNKNOWN,
            "shape": UNKNOWN,
            "dimensions": {},
            "zero_azimuth_location": "the x axis of the surface; forward scattering is at phi_r = phi_i + 180 deg",
        }
        | ({"properties_symmetry": symmetry} if symmetry else {}),
        "environment": "NA",
        "comments": "The time is that of writing: the file that this was made of does not say when it was measured.",
        "adhoc_section": {_SECTION: gonio_section},
    }
