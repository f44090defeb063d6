"""Example files that the tests copy into a copy of the project; no existing file there is edited."""
