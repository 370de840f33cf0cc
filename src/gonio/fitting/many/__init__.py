"""Fits of many scans at once, compiled by JAX: the arrays have one lane (the last axis) for each scan."""
