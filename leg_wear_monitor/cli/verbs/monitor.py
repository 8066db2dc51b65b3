"""``leg-wear-monitor monitor``: the node that follows a real leg."""

from leg_wear_monitor.cli.node import node_verb

monitor = node_verb(
    "monitor",
    "monitor_node",
    "Run the monitor as a ROS 2 node.",
    """Monitor the joint wear of a leg from joint_states and drive_torque.

    The node monitors as soon as it runs. Parameters: --ros-args --params-file FILE, or -p NAME:=VALUE;
    docs/reference/parameters.md lists them. `ros2 run leg_wear_monitor monitor` starts the same node.
    """,
)
