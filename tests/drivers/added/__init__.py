"""Example files that the tests add to a copy of the project. The tests edit no existing file there."""
