"""ROS 2's wire without ROS, with zenoh."""
