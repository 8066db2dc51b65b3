"""The crank's zero of an encoder that starts at zero, found from the drive torque."""
