"""The description of a fleet, fleet.yaml."""
