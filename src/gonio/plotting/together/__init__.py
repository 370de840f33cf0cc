"""Figures of several sets of data: samples, channels or wavelengths in the same panels."""
