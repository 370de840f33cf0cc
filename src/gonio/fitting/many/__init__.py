"""Fits of many scans at once, compiled by JAX: each scan is a lane, a place along the last axis of every array."""
