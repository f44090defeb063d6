"""What the drivers of dry-contact devices share: codes on several lines, and which wiring is unsafe."""
