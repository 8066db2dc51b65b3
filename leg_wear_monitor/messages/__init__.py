"""ROS messages without ROS: CDR codec, definitions, decoding of inputs, encoding of outputs."""
