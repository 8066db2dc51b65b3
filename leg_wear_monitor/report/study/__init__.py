"""HTML pages of studies."""
