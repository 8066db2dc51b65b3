"""Tables as recordings: CSV, Parquet, data frames and arrays."""
