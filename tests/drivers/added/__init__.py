"""Example files that the tests add to a copy of the project. No file of the project itself is
edited."""
