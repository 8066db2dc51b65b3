"""Calls computed in processes of this machine or on a Dask cluster."""
