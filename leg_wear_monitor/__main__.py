"""``python -m leg_wear_monitor``."""

from leg_wear_monitor.cli.start import main

main()
