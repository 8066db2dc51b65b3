"""``python -m leg_wear_monitor``."""

from leg_wear_monitor.cli.main import main

main()
