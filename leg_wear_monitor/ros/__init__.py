"""The nodes; ROS is spoken here and nowhere else."""
