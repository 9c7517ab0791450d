"""Recordings and evaluations as logs that other programs read: Parquet, and MCAP for PlotJuggler and Foxglove."""
