"""Small valid files of every format, one module a format module: `samples(folder)` writes them and returns the paths."""
