"""Rollouts of new package versions to two machines (`make test-rollout`). The machines are containers
of Debian with systemd."""
