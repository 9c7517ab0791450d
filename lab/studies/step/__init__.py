"""Steps of integration side by side: their error, and what controllers make of it."""
