"""What runs inside of the machine. Only the standard library is imported, but by the far sides."""
