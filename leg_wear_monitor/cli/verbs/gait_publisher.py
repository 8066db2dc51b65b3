"""``leg-wear-monitor gait-publisher``: the synthetic leg as a node."""

from leg_wear_monitor.cli.node import node_verb

gait_publisher = node_verb(
    "gait-publisher",
    "gait_publisher.node",
    "The synthetic leg as a ROS 2 node.",
    """Publish what the sensors of a synthetic leg say: joint_states and drive_torque.

    The leg walks in full coordinates with clearances and wear of its own; noise, loss, load, speed and a
    knocking joint are parameters: --ros-args -p NAME:=VALUE, or --params-file FILE. `ros2 param describe`
    tells them. What `ros2 run leg_wear_monitor gait_publisher` starts.
    """,
)
