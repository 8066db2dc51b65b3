"""Points of a study computed in processes or on a Dask cluster."""
