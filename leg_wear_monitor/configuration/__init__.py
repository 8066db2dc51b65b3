"""Reading and checking settings: YAML within bounds, strict conversion with one clear line an error."""
