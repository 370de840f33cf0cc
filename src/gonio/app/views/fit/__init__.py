"""One fit: its values, how sure they are, and what one has to know to read it."""
