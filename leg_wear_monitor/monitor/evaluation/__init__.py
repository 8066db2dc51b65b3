"""What the cycles mean: alarms evaluated period by period, checks of the torque, evidence of the gait."""
