"""The studies, one file each: question, settings, points, page."""
