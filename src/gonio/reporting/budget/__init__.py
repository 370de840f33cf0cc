"""The budget of a scan's uncertainty by cause, for every page that shows one, and what the causes do to a fit."""

from gonio.reporting.budget.causes import budget_blocks
from gonio.reporting.budget.effects import effect_blocks

__all__ = ["budget_blocks", "effect_blocks"]
