"""Quality of service of topics, in the format of rosbag2 (metadata version 9)."""

import attrs

_PROFILE = """- history: keep_last
  depth: {depth}
  reliability: {reliability}
  durability: {durability}
  deadline: {forever}
  lifespan: {forever}
  liveliness: automatic
  liveliness_lease_duration: {forever}
  avoid_ros_namespace_conventions: false"""
_FOREVER = "{sec: 9223372036, nsec: 854775807}"


@attrs.frozen
class Qos:
    """Quality of service offered by a publisher."""

    reliability: str = "reliable"
    durability: str = "volatile"
    depth: int = 10

    def text(self) -> str:
        """YAML text for a channel's metadata."""
        return _PROFILE.format(forever=_FOREVER, **attrs.asdict(self))


RELIABLE = Qos()
SENSOR_DATA = Qos(reliability="best_effort", depth=200)
LATCHED = Qos(durability="transient_local", depth=1)
