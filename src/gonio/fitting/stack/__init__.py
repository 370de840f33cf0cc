"""Fits of stacks in Zarr stores by many processes, block by block, resumed after a crash."""
