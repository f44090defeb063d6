"""The transport `dds`. It speaks as a ROS 2 node through cyclonedds, and needs no ROS."""
