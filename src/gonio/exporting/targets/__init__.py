"""Programs that take models: each file declares one `Target` or several, and `registry` finds them."""
