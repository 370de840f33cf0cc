"""What a fit minimises: a model and a scan as two functions of numbers, and what they are made of."""
