"""ROS parameters from declared ones."""
