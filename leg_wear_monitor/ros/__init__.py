"""The ROS 2 nodes; no other sub-package imports rclpy."""
