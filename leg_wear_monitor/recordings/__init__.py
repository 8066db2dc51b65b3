"""Recordings: ROS messages, MCAP, db3 and tables, and their replay through the monitor."""
