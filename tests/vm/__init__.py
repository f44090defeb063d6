"""Tests on a whole machine: Debian on a kernel with gpio-sim and vcan, booted in QEMU. `make
test-vm`.
"""
