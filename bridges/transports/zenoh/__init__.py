"""The transport `zenoh`: speaks as a ROS 2 node without ROS, through zenoh."""
