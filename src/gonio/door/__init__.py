"""Guarded reading of files from outside: containers and texts, checked before anything of their size is allocated.

A damaged or hostile file raises FormatError with the place (a line or a byte) and what was expected there.
"""
