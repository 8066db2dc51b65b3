"""Publishers, markers, the recording of the node."""
