"""Programs inside the machine. All but the far sides import only the standard library."""
