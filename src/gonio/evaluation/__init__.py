"""A model evaluated for many pairs of directions, such as 1e7 to 1e9, in bounded memory."""

from gonio.evaluation.batches import evaluate

__all__ = ["evaluate"]
