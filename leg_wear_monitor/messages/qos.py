"""Quality of service of topics, in the format of rosbag2 (metadata version 9)."""

import attrs

_FOREVER = {"sec": 9223372036, "nsec": 854775807}


@attrs.frozen
class Qos:
    """Quality of service offered by a publisher."""

    reliability: str = "reliable"
    durability: str = "volatile"
    depth: int = 10

    def profile(self) -> dict[str, object]:
        """Mapping as in metadata.yaml."""
        return {
            "history": "keep_last",
            "depth": self.depth,
            "reliability": self.reliability,
            "durability": self.durability,
            "deadline": dict(_FOREVER),
            "lifespan": dict(_FOREVER),
            "liveliness": "automatic",
            "liveliness_lease_duration": dict(_FOREVER),
            "avoid_ros_namespace_conventions": False,
        }

    def text(self) -> str:
        """YAML text for a channel's metadata."""
        lines = []
        for key, value in self.profile().items():
            if isinstance(value, dict):
                lines += [f"{key}:", *(f"  {part}: {number}" for part, number in value.items())]
            else:
                lines.append(f"{key}: {str(value).lower()}")
        return "- " + "\n  ".join(lines)


RELIABLE = Qos()
SENSOR_DATA = Qos(reliability="best_effort", depth=200)
LATCHED = Qos(durability="transient_local", depth=1)
