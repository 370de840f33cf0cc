"""Small valid files of every format, one module a format or family: `samples(folder)` writes them, and lists them."""
