"""Parts that two or more models share: plain functions in the array library that their arguments came with."""
