"""Programs inside the machine. They import only the standard library, except the far sides."""
