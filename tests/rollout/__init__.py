"""The rollout on two machines: Debian in containers, each with systemd as process 1. `make
test-rollout`.
"""
