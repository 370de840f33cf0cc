"""Readings through polarisers put together: those of each state side by side, and degrees of linear polarisation."""
