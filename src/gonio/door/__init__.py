"""Files from outside: bytes in, checked values out, and a FormatError with the place where that cannot be."""
