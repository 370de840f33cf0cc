"""Small valid files, one module a format module: `samples(folder)` writes them and returns their paths."""
