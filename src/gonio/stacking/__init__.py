"""Many files of scans made into one stack in a Zarr store, which `fit_stack` and `fit_many` take.

from gonio.stacking import stack

done = stack(["csv"], "wafers.zarr")  # a folder: all files in it that can be read, in the order of their names
print(done.names, done.notes)
"""

from gonio.stacking.build import Stacked, stack

__all__ = ["Stacked", "stack"]
