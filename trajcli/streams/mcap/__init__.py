"""MCAP, the log format of ROS 2: messages of a motion, written and read."""
