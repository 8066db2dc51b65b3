"""Evaluation of gait cycles: alarms in each evaluation period, checks of the torque, evidence of the gait."""
