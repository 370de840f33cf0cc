"""Promises that every target keeps: a Lambertian surface of 0.5 comes back, and the file says what it is."""

import pytest

import gonio
from gonio.exporting import targets
from gonio.exporting.entry import write
from gonio.exporting.subject import of_model
from gonio.formats import formats

# Tables are tried in test_tables.py, which takes a minute.
WRITTEN = [t for t in targets().values() if not t.refused and t.name not in {*formats(), "fred-table", "radiance-xml"}]
LAMBERT = of_model(gonio.catalogue["lambert"], {"rho": 0.5})


@pytest.mark.parametrize("target", WRITTEN, ids=lambda t: t.name)
def test_a_lambertian_surface_comes_back(target, tmp_path):
    """By the target's own proof: the written file is run, or read again, and compared with 0.5/pi."""
    done = write(LAMBERT, tmp_path / f"half{target.suffixes[0]}", target.name)
    assert done.files[0].stat().st_size > 0
    assert target.check is not None
    proof = done.prove()
    assert proof.error <= proof.limit
    text = done.files[0].read_bytes().decode("utf-8", "replace")
    assert "gonio" in text
    assert "lambert" in text
