"""Files that hold other things whole: an array of NumPy, the members of a ZIP archive."""
