"""Example files that the tests add to a copy of the project. The project's own files stay unchanged."""
