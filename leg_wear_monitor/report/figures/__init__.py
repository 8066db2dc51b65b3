"""Figures of mechanisms, forces, wear and lives."""
