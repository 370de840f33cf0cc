"""Zarr stores: what comes back, what is refused before it is allocated, and what is read only as far as it is used."""

import json
import shutil
import tracemalloc

import numpy as np
import pytest
import xarray as xr

from gonio import read, write
from gonio.door import zarr_chunks
from gonio.files import FormatError
from gonio.formats.native import zarr_store
from gonio.measured import sound as checks
from samples.zarr import dense, flat, samples


@pytest.mark.parametrize("scan", [flat(), dense()], ids=["flat", "dense"])
def test_everything_comes_back(scan, tmp_path):
    write(scan, tmp_path / "scan.zarr")
    found = read(tmp_path / "scan.zarr")
    xr.testing.assert_equal(found, scan)
    assert found["brdf"].dims == scan["brdf"].dims
    for name in scan.variables:
        assert found[name].attrs == scan[name].attrs
        assert found[name].dtype.kind == scan[name].dtype.kind
    assert found.attrs["provenance"] == scan.attrs["provenance"]


def test_other_programs_read_it_without_us(tmp_path):
    write(flat(), tmp_path / "scan.zarr")
    with xr.open_zarr(tmp_path / "scan.zarr", chunks=None) as found:
        np.testing.assert_array_equal(found["brdf"], flat()["brdf"])
        index = found["channel"].values
        assert np.array(found["channel"].attrs["names"])[index].tolist() == ["R", "R", "G", "µ"]


def test_writing_takes_the_place_of_a_store_by_force_only(tmp_path):
    path = tmp_path / "scan.zarr"
    write(flat(), path)
    with pytest.raises(FileExistsError, match="--force"):
        write(dense(), path)
    xr.testing.assert_equal(read(path), flat())
    write(dense(), path, force=True)
    xr.testing.assert_equal(read(path), dense())
    assert [p.name for p in tmp_path.iterdir()] == ["scan.zarr"]


def test_big_arrays_stay_in_the_file(tmp_path, monkeypatch):
    n = 250_000
    monkeypatch.setattr(zarr_store, "MOST_BYTES_IN_MEMORY", 1_000_000)
    monkeypatch.setattr(zarr_store, "VALUES_OF_CHUNK", 65_536)
    monkeypatch.setattr(checks, "VALUES_AT_ONCE", 65_536)
    scan = xr.Dataset(
        {"brdf": ("direction", np.linspace(1, 2, n), {"units": "sr-1"})},
        coords={a: ("direction", np.linspace(0, 80, n), {"units": "degree"}) for a in ("theta_i", "theta_r", "phi")},
        attrs={"provenance": ""},
    )
    path = tmp_path / "big.zarr"
    write(scan, path)
    assert sorted(p.name for p in (path / "brdf" / "c").iterdir()) == ["0", "1", "2", "3"]
    read(samples(tmp_path)[0])  # what is imported is not what is held
    tracemalloc.start()
    found = read(path)
    held, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    # The four arrays are 8 MB, a chunk 0.5 MB; while it is checked a chunk is there packed, plain and as masks.
    assert held < 1e6
    assert peak < 4e6
    assert float(found["brdf"][n - 1]) == 2.0
    xr.testing.assert_equal(found.isel(direction=slice(10, 20)), scan.isel(direction=slice(10, 20)))


def metadata(path, change):
    text = json.loads(path.read_text())
    change(text)
    path.write_text(json.dumps(text, indent=2))


def with_shape(*shape):
    def change(path):
        metadata(path / "brdf" / "zarr.json", lambda m: m.update(shape=list(shape)))

    return change


def with_chunk(*shape):
    def change(path):
        metadata(
            path / "brdf" / "zarr.json", lambda m: m["chunk_grid"]["configuration"].update(chunk_shape=list(shape))
        )

    return change


def with_value(key, value, name="brdf/zarr.json"):
    return lambda path: metadata(path / name, lambda m: m.update({key: value}))


def with_bytes(name, change):
    return lambda path: (path / name).write_bytes(change((path / name).read_bytes()))


def summed(raw):
    import google_crc32c

    return raw + google_crc32c.value(raw).to_bytes(4, "little")


def frame(size):
    """The header of a zstd frame that promises `size` bytes."""
    return b"\x28\xb5\x2f\xfd\xe0" + size.to_bytes(8, "little")


def flipped(raw):
    return bytes([raw[0] ^ 1]) + raw[1:]


BAD = {
    "shape": (with_shape(2**62), "brdf/zarr.json, line 2", "more than 50000000 values"),
    "shape-negative": (with_shape(-4), "brdf/zarr.json, line 2", "no list of counts"),
    "shape-half": (with_shape(4.5), "brdf/zarr.json, line 2", "no list of counts"),
    "nothing-by-2^62": (
        lambda path: (with_shape(0, 2**62)(path), with_chunk(2, 2)(path)),
        "zarr.json, line 1",
        "number of dimensions",
    ),
    "dimensions": (with_shape(4, 1), "brdf/zarr.json, line 7", "not as many counts"),
    "more": (with_shape(40), "brdf/c/1, byte 0", "a chunk is missing"),
    "chunk": (with_chunk(2**40), "brdf/zarr.json, line 6", "a chunk would be"),
    "chunk-zero": (with_chunk(0), "brdf/zarr.json, line 6", "no regular chunk_grid"),
    "chunk-other": (with_chunk(5), "brdf/c/0, byte 0", "32 bytes, not 40"),
    "kind": (with_value("data_type", "string"), "brdf/zarr.json, line 5", "data_type is 'string'"),
    "format": (with_value("zarr_format", 2), "brdf/zarr.json, line", "zarr_format is not 3"),
    "codec": (with_value("codecs", [{"name": "bytes"}, {"name": "gzip"}]), "brdf/zarr.json, line", "codecs are not"),
    "codecs": (with_value("codecs", 7), "brdf/zarr.json, line", "codecs are not"),
    "transformers": (with_value("storage_transformers", [1]), "brdf/zarr.json, line", "storage_transformers"),
    "keys": (with_value("chunk_key_encoding", {"name": "v2"}), "brdf/zarr.json, line", "chunk_key_encoding"),
    "node": (with_value("node_type", "group"), "brdf/zarr.json, line", "brdf is no array"),
    "root": (with_value("node_type", "array", "zarr.json"), "zarr.json, line", "root is no group"),
    "json": (with_bytes("brdf/zarr.json", lambda raw: raw[:50]), "brdf/zarr.json, line 5", "no JSON"),
    "empty": (with_bytes("zarr.json", lambda raw: b""), "zarr.json, line 1", "no JSON"),
    "deep": (with_bytes("zarr.json", lambda raw: b"[" * 900_000), "zarr.json, line 1", "64 deep"),
    "bit": (with_bytes("brdf/c/0", flipped), "brdf/c/0, byte", "checksum differs"),
    "cut": (with_bytes("brdf/c/0", lambda raw: raw[:-3]), "brdf/c/0, byte", "checksum differs"),
    "no-bytes": (with_bytes("brdf/c/0", lambda raw: b""), "brdf/c/0, byte 0", "checksum differs"),
    "long": (with_bytes("brdf/c/0", lambda raw: raw * 100), "brdf/c/0, byte 0", "longer than its values need"),
    "bomb": (
        with_bytes("brdf/c/0", lambda raw: summed(frame(2**40))),
        "brdf/c/0, byte 0",
        "1099511627776 bytes, not 32",
    ),
    "sizeless": (
        with_bytes("brdf/c/0", lambda raw: summed(b"\x28\xb5\x2f\xfd\0\0\0")),
        "brdf/c/0, byte 0",
        "no stated",
    ),
    "frame": (with_bytes("brdf/c/0", lambda raw: summed(frame(32))), "zarr.json, line 1", "damaged Zarr store"),
    "lost-chunk": (lambda path: (path / "phi/c/0").unlink(), "phi/c/0, byte 0", "a chunk is missing"),
    "lost-metadata": (lambda path: (path / "phi/zarr.json").unlink(), "phi/zarr.json, byte 0", "no file phi/zarr.json"),
    "lost-array": (lambda path: shutil.rmtree(path / "phi"), "zarr.json, line 1", "has no phi"),
    "names": (with_value("attributes", {"names": ["R"]}, "channel/zarr.json"), "zarr.json, line 1", "no name for"),
    "unit": (with_value("attributes", {"units": "K"}), "brdf/zarr.json, line 1", "no unit sr-1"),
}


@pytest.fixture(scope="module")
def sound(tmp_path_factory):
    """A store that tests copy before they damage it."""
    return samples(tmp_path_factory.mktemp("sound"))[0]


@pytest.mark.parametrize("name", BAD)
def test_damaged_stores_are_refused_with_their_place(name, sound, tmp_path):
    damage, where, what = BAD[name]
    path = shutil.copytree(sound, tmp_path / "scan.zarr")
    damage(path)
    with pytest.raises(FormatError) as caught:
        read(path)
    assert what in caught.value.what
    assert caught.value.where.startswith(where)
    assert "\n" not in str(caught.value)


def stored(scan, folder):
    write(scan, folder / "scan.zarr")
    return folder / "scan.zarr"


@pytest.mark.parametrize(
    ("change", "where", "what"),
    [
        (lambda s: s.assign(brdf=s["brdf"] * 0), "brdf/", "zero or missing"),
        (lambda s: s.where(False), "brdf/", "zero or missing"),
        (lambda s: s.assign(brdf=s["brdf"].fillna(np.inf)), "brdf/c", "infinite"),
        (lambda s: s.assign_coords(theta_i=s["theta_i"] * 4), "theta_i/c", "theta_i holds 120"),
        (lambda s: s.assign_coords(phi=s["phi"] * np.nan), "phi/c", "phi holds nan"),
        (lambda s: s.assign_coords(theta_r=s["theta_r"].astype(str)), "theta_r/", "no array of numbers"),
    ],
)
def test_what_is_no_scan_is_refused(change, where, what, tmp_path):
    scan = change(flat())
    scan["brdf"].attrs["units"] = "sr-1"
    with pytest.raises(FormatError, match=what) as caught:
        read(stored(scan, tmp_path))
    assert caught.value.where.startswith(where)


def test_format_2_and_other_directories(tmp_path):
    old = tmp_path / "old.zarr"
    old.mkdir()
    (old / ".zgroup").write_text('{"zarr_format": 2}')
    with pytest.raises(FormatError, match="format 2: save it in format 3"):
        read(old)
    (tmp_path / "other").mkdir()
    with pytest.raises(FormatError, match="is a directory"):
        read(tmp_path / "other")
    (tmp_path / "text.csv").write_text("/zarr\n/zarr.json.txt\n")
    assert not zarr_store.FORMAT.recognises((tmp_path / "text.csv").read_bytes())


def test_promised_length_of_zstd_frames():
    """RFC 8878: the descriptor's two highest bits and bit 5 say how wide the length is; two bytes are offset by 256."""
    magic = b"\x28\xb5\x2f\xfd"
    assert zarr_chunks._content(magic + b"\x20\x60rest") == 0x60
    assert zarr_chunks._content(magic + b"\x60\x01\x00") == 257
    assert zarr_chunks._content(magic + b"\xa0\x00\x00\x01\x00") == 65536
    assert zarr_chunks._content(magic + b"\x81\x58\x07\x10\x00\x00\x00") == 16  # a window and a dictionary before it
    assert zarr_chunks._content(magic + b"\x00\x58rest") is None
    assert zarr_chunks._content(b"nothing at all") is None
