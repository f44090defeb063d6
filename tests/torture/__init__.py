"""What docs/reliability.md shows: real daemons, hurt from outside, on loopback (`make torture`)."""
