"""What models rest on: the publications that gonio cites, and the equations in the docstrings of terms."""
