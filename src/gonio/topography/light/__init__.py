"""What light makes of a surface: the band that it sees, its scatter by waves and by facets, and fits beside both."""
