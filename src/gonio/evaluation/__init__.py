"""A model evaluated for many pairs of directions, 1e7 to 1e9 say, in bounded memory."""

from gonio.evaluation.batches import evaluate

__all__ = ["evaluate"]
