"""Scans and fits on a page that answers at once: served to a browser, in one file, or in a notebook."""
