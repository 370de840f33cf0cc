"""The tensor_file container: its bytes as specified, and files that promise what they do not hold."""

import struct

import numpy as np
import pytest

from gonio.door.tensor_file import TYPES, Fields, write_fields
from gonio.files import FormatError


def entry(name, kind, start, *shape, dimensions=None):
    """One field of the header, by the specification."""
    count = len(shape) if dimensions is None else dimensions
    return struct.pack("<H", len(name)) + name + struct.pack("<HBQ", count, kind, start) + struct.pack(
        f"<{len(shape)}Q", *shape
    )  # fmt: skip


def file_of(tmp_path, *entries, data=b"", version=(1, 0), count=None):
    path = tmp_path / "a.bin"
    head = b"tensor_file\0" + bytes(version) + struct.pack("<I", len(entries) if count is None else count)
    path.write_bytes(head + b"".join(entries) + data)
    return path


def test_reads_what_the_specification_says(tmp_path):
    values = struct.pack("<6f", 1, 2, 3, 4, 5, 6.5)
    path = file_of(tmp_path, entry(b"grid", 10, 64, 2, 3), data=bytes(64 - 18 - 2 - 4 - 11 - 16) + values)
    found = Fields(path)
    assert found.starts == {"grid": 64}
    assert found.arrays["grid"].tolist() == [[1, 2, 3], [4, 5, 6.5]]
    assert not found.arrays["grid"].flags.owndata


def test_every_type_survives(tmp_path):
    path = tmp_path / "a.bin"
    fields = {f"field {kind}": np.arange(6).reshape(2, 1, 3).astype(dtype) for kind, dtype in TYPES.items()}
    write_fields(path, fields)
    found = Fields(path)
    assert list(found.arrays) == list(fields)
    for name, values in fields.items():
        np.testing.assert_array_equal(found.arrays[name], values)
        assert found.arrays[name].dtype == values.dtype
        assert found.starts[name] % 8 == 0


def test_arrays_of_the_other_byte_order_and_of_strides_are_stored_plainly(tmp_path):
    path = tmp_path / "a.bin"
    values = np.arange(6.0).reshape(2, 3)
    write_fields(path, {"turned": values.T, "big": values.astype(">f8")})
    assert Fields(path).arrays["turned"].tolist() == values.T.tolist()
    assert Fields(path).arrays["big"].tolist() == values.tolist()


@pytest.mark.parametrize(
    ("content", "byte", "message"),
    [
        ({"entries": [], "count": 0}, 14, "0 fields are outside 1 to 256"),
        ({"entries": [], "count": 2**32 - 1}, 14, "4294967295 fields are outside"),
        ({"entries": [entry(b"a", 10, 0, 1)], "version": (2, 0)}, 12, "version 2.0 of the container is unknown"),
        ({"entries": [entry(b"", 10, 0, 1)]}, 18, "name has 0 bytes"),
        ({"entries": [entry(b"\xff", 10, 0, 1)]}, 20, "no UTF-8 text"),
        ({"entries": [entry(b"a", 12, 0, 1)]}, 23, "the type of 'a' is 12, outside 1 to 11"),
        ({"entries": [entry(b"a", 1, 0, 1, dimensions=60000)]}, 21, "has 60000 dimensions, more than 8"),
        ({"entries": [entry(b"a", 1, 0, 1), entry(b"a", 1, 0, 1)]}, 40, "the field 'a' occurs twice"),
        ({"entries": [entry(b"a", 10, 0, 2**62)]}, 40, "'a' has 4611686018427387904 values, more than"),
        ({"entries": [entry(b"a", 10, 0, 2**32, 2**32)]}, 48, "'a' has 18446744073709551616 values, more than"),
        ({"entries": [entry(b"a", 10, 0, 0, 5)]}, 48, "holds no value"),
        ({"entries": [entry(b"a", 10, 0, 1000)]}, 0, "'a' needs 4000 bytes, and the file has"),
        ({"entries": [entry(b"a", 10, 2**63, 1)]}, 2**63, "'a' needs 4 bytes, and the file has 0 left there"),
        ({"entries": [entry(b"a", 10, 0, 1)], "count": 2}, 40, "the length of a field's name needs 2 bytes"),
    ],
)
def test_faults_are_named_with_their_byte(tmp_path, content, byte, message):
    content = dict(content)
    path = file_of(tmp_path, *content.pop("entries"), **content)
    with pytest.raises(FormatError, match=message) as caught:
        Fields(path)
    assert caught.value.where == f"byte {byte}"


def test_other_files_are_no_tensor_files(tmp_path):
    path = tmp_path / "a.bin"
    path.write_bytes(b"tensor-file\0\1\0")
    with pytest.raises(FormatError, match="byte 0: this is no tensor file"):
        Fields(path)
