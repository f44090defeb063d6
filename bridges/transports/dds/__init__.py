"""ROS 2's wire without ROS, by cyclonedds."""
