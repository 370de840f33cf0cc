"""Figures, one a file. Each function returns a Matplotlib Figure; `save` writes it as PNG and SVG."""
