"""A scan at other directions: interpolation, comparison of two scans, and conversion into any format."""
