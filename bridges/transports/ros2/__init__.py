"""A ROS 2 node, by rclpy."""
