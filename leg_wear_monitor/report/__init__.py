"""HTML pages and figures of runs, studies and lives."""
