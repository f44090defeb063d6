"""The ROS package beside the pip one."""
