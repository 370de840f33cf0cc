"""The budget of a scan's uncertainty, drawn."""
