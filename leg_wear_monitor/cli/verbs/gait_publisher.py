"""``leg-wear-monitor gait-publisher``: the synthetic leg as a node."""

from leg_wear_monitor.cli.node import node_verb

gait_publisher = node_verb(
    "gait-publisher",
    "gait_publisher.node",
    "Run the synthetic leg as a ROS 2 node.",
    """Publish the sensor signals of a synthetic leg: joint_states and drive_torque.

    The leg is simulated in full coordinates with its own clearances and wear; noise, loss, load, speed and a
    knocking joint are parameters: --ros-args -p NAME:=VALUE, or --params-file FILE. `ros2 param describe`
    explains them. `ros2 run leg_wear_monitor gait_publisher` starts the same node.
    """,
)
