"""What the commands of measuring show: a plan, a run, and the deviations of a verification."""
