"""Pages that gonio writes."""
