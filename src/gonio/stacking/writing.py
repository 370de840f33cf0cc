"""The Zarr store of a stack, written scan by scan: one chunk of scans is held in memory, whatever their number."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import xarray as xr

from gonio.fitting.stack.store import consolidate, with_settled_texts
from gonio.measured.causes import CAUSE, SYSTEMATIC, TOTAL, WHOLE, total
from gonio.stacking.layout import LANED, Layout, Taken

SAMPLE = "sample"
SCANS_OF_CHUNK = 1024  # a chunk is a file: one for each scan would be a million files
VALUES_OF_CHUNK = 2**22  # of long scans fewer are in a chunk: 32 MiB, of which some are held at once


class Writer:
    """The values of the scans of a stack, put in one after another and written whenever a chunk is full."""

    def __init__(self, path: Path, layout: Layout, most: int) -> None:
        """Begin a store for at most so many scans."""
        import zarr

        self.path, self.layout = path, layout
        self.count, self.stating = 0, 0
        self.causes: tuple[str, ...] = ()  # of the first scan; none as soon as another has others
        self.chunk = max(1, min(most, SCANS_OF_CHUNK, VALUES_OF_CHUNK // max(1, layout.points)))
        self._most = most
        self._group = zarr.open_group(path, mode="w", zarr_format=3)
        self._held: dict[str, npt.NDArray[np.float64]] = {}
        self._begin("brdf")

    def _begin(self, name: str, *further: str) -> None:
        """An array over all scans that has no chunk yet, and room for those of one; of causes with that dimension."""
        from zarr.codecs import Crc32cCodec, ZstdCodec

        shape = (*[len(self.causes)] * len(further), *self.layout.shape)
        self._group.create_array(
            name,
            shape=(self._most, *shape),
            chunks=(self.chunk, *(max(1, n) for n in shape)),
            dtype="float64",
            fill_value=np.nan,
            compressors=[ZstdCodec(level=3), Crc32cCodec()],
            dimension_names=[SAMPLE, *further, *map(str, self.layout.dims)],
            attributes={"units": self.layout.unit},
        )
        self._held[name] = np.full((self.chunk, *shape), np.nan)

    def _begin_causes(self, taken: Taken) -> None:
        """Arrays of the causes of the first scan, and of all of them together."""
        self.causes = tuple(taken.shifts)
        if self.causes:
            self._begin(TOTAL)
        if self.causes not in ((), (WHOLE,)):
            self._begin(SYSTEMATIC, CAUSE)

    def add(self, taken: Taken) -> None:
        """The next scan. Uncertainties are kept as long as every scan so far has stated them, causes so as well."""
        if self.count == 0 and taken.uncertainty is not None:
            self._begin("uncertainty")
        if self.count == 0:
            self._begin_causes(taken)
        elif set(self.causes) != set(taken.shifts):
            self._drop(SYSTEMATIC, TOTAL)
            self.causes = ()
        self.stating += taken.uncertainty is not None
        place = self.count % self.chunk
        self._held["brdf"][place] = taken.brdf
        if self.states_uncertainties and taken.uncertainty is not None:
            self._held["uncertainty"][place] = taken.uncertainty
        if self.causes:
            shifts = np.array([taken.shifts[name] for name in self.causes])
            self._held[TOTAL][place] = total(shifts)
            if SYSTEMATIC in self._held:
                self._held[SYSTEMATIC][place] = shifts
        self.count += 1
        if self.count % self.chunk == 0:
            self._flush(self.chunk)

    def _drop(self, *names: str) -> None:
        for name in names:
            if self._held.pop(name, None) is not None:
                del self._group[name]

    @property
    def states_uncertainties(self) -> bool:
        """Whether every scan so far, but for the one that is being added, states its uncertainties."""
        return "uncertainty" in self._held and self.stating >= self.count

    def _flush(self, rows: int) -> None:
        """Write the last so many scans, which begin a chunk."""
        for name, held in self._held.items():
            array: Any = self._group[name]
            array[self.count - rows : self.count] = held[:rows]

    def finish(self, names: Sequence[str], attrs: Mapping[str, Any]) -> None:
        """Write what is held, cut the arrays to the scans that there are, and add names and common coordinates."""
        if rows := self.count % self.chunk:
            self._flush(rows)
        for name in list(self._held):
            array: Any = self._group[name]
            array.resize((self.count, *array.shape[1:]))
        if "uncertainty" in self._held and self.stating < self.count:
            del self._group["uncertainty"]
        coords = self.layout.coords.assign_coords({SAMPLE: (SAMPLE, np.array(list(names), dtype=str))})
        if SYSTEMATIC in self._held:
            coords = coords.assign_coords({CAUSE: (CAUSE, np.array(self.causes, dtype=str))})
        coords.attrs = {**self.layout.coords.attrs, **attrs}
        stored = with_settled_texts(coords).drop_encoding()
        stored.to_zarr(self.path, mode="a", zarr_format=3, consolidated=False)
        consolidate(self.path)


def left_out(scan: xr.Dataset) -> set[str]:
    """The variables of a scan that a stack has no place for.

    A mask is not one of them, as its values become gaps, and lines of the file are no measurement.
    """
    return {str(n) for n in scan.data_vars if n not in (*LANED, "mask", "line")}
