"""docs/explanation/reliability.md: real daemons, hurt from outside, on loopback (`make torture`)."""
