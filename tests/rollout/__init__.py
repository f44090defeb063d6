"""A rollout to two machines (`make test-rollout`). The machines are containers of Debian with
systemd."""
