"""What `gonio topography` shows."""
