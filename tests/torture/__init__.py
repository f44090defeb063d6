"""Attacks on real daemons over loopback (`make torture`). See docs/explanation/reliability.md."""
