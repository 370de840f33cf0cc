"""Stacks of scans: how one was made of files, and what came of its fits."""
