"""Tests on a whole machine (`make test-vm`). QEMU boots Debian on a kernel with gpio-sim and vcan."""
