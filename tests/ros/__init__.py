"""The ROS package beside the package for pip."""
