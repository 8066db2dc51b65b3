"""Picture of a mechanism, working or not: one HTML file, or SVG."""
