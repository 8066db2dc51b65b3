"""Figures of mechanisms, forces, wear and lives, drawn by matplotlib."""
