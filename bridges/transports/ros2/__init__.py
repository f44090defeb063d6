"""A ROS 2 node, with rclpy."""
