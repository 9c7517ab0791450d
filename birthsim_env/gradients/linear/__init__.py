"""The plant near one operating point: a linear model with names and units."""
