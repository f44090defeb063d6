"""The transport `ros2`: a ROS 2 node, through rclpy."""
