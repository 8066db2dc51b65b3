"""Results of a study on disk, each bound to its settings by a checksum."""
