"""ROS parameters, generated from configuration classes."""
