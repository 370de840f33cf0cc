"""A scan at other directions: interpolation, comparison of two scans, and conversion into any format.

Each file builds on those before it:

- interpolation: linear between directions, on grids or between scattered directions; the lobe follows the mirror
  direction from one incidence angle to the next.
- lookup: values at the very directions that were measured, to the last bit.
- resample: a scan at any directions by these two, with symmetries imposed and gaps filled where asked.
- difference: two scans at common directions, weighted by solid angle.
- conversion: a scan into a file of any format, with the error that this cost.
"""
