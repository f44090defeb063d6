"""The transport `ros2`, which is a ROS 2 node with rclpy."""
