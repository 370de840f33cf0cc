"""Mitsuba 3: a Python file that registers a BSDF, which evaluates, samples and differentiates the formula itself."""
