"""What instruments give: one xarray Dataset, checked, masked, read and written."""
