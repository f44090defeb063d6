"""The transport `dds`: speaks as a ROS 2 node without ROS, through cyclonedds."""
