"""What every run needs: drive, run statistics, integrator formulas, the Run protocol."""
