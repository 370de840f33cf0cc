"""The steps of a reduction, one concern a file: each takes readings or numbers, and knows none of the others."""
