"""What people use to look at bridges, try them and commission them. No daemon loads any of it."""
