"""Magnitudes and albedos, as plain data and for people."""
