"""What a BiRD file says beside its numbers: read as lines of provenance and kept whole, written again or made up."""

import hashlib
import json
import uuid
from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

import xarray as xr

from gonio.door.json_text import Document

METADATA = "bird_metadata"  # attribute: the metadata of the file as JSON
_OWN = "gonio"  # section of ours: provenance and history
SCHEMA = "https://raw.githubusercontent.com/BiRD-project/BiRD_view/master/BRDF_JSON_schema/brdf_json_schema_v1.0.json"
UNKNOWN = "unknown"
_PLACE = dict.fromkeys(("country", "city", "street", "building_nr", "postal_code"), UNKNOWN)


def attributes(document: Document) -> dict[str, str]:
    """provenance, history, symmetry and the whole metadata of a file."""
    metadata = document.object("metadata")
    section = metadata.get("adhoc_section")
    own = section.get(_OWN) if isinstance(section, dict) else None
    own = own if isinstance(own, dict) else {}
    kept = {k: v for k, v in metadata.items() if k != "adhoc_section" or v != {_OWN: own}}
    found = {"provenance": own.get("provenance"), "history": own.get("history")}
    attrs = {name: text if isinstance(text, str) else "" for name, text in found.items()}
    if not isinstance(found["provenance"], str):
        attrs["provenance"] = "\n".join(lines(kept))
    if not own.get("made_up"):
        attrs[METADATA] = json.dumps(kept, ensure_ascii=False)
    sample = metadata.get("sample")
    symmetry = sample.get("properties_symmetry") if isinstance(sample, dict) else None
    if symmetry in ("isotropic", "anisotropic"):
        attrs["symmetry"] = symmetry
    return attrs


def lines(metadata: Any) -> Iterator[str]:
    """`sample.name: SRT1` for every value, in order, and without recursion."""
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
    """The metadata to write: those that the scan was read with, or ones that say what is not known."""
    own = {name: str(scan.attrs[name]) for name in ("history", "provenance") if scan.attrs.get(name)}
    try:
        kept = json.loads(scan.attrs[METADATA])
    except (KeyError, ValueError):
        kept = None
    if not isinstance(kept, dict):
        return _made_up(scan, own | {"provenance": own.get("provenance", ""), "made_up": True})
    section = kept.get("adhoc_section")
    if own.get("provenance") == "\n".join(lines(kept)):
        del own["provenance"]
    return kept | {"adhoc_section": (section if isinstance(section, dict) else {}) | {_OWN: own}}


def _made_up(scan: xr.Dataset, own: dict[str, Any]) -> dict[str, Any]:
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
        "description": own["provenance"].partition("\n")[0] or "BRDF written by gonio",
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
        "adhoc_section": {_OWN: own},
    }
