"""How the leg moves when its joints have clearance."""
