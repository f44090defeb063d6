"""Stories of the robot's core in virtual time."""
