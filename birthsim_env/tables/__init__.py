"""Tables of named columns that a user wrote: CSV, Parquet, MCAP and MATLAB files, read in one way by all that takes them."""
