"""The transport `zenoh`. It speaks as a ROS 2 node through zenoh, and needs no ROS."""
