"""Not a bus: something that a bus's file needs."""
