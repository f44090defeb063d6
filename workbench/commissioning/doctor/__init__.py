"""`rmf-bridge doctor`: what keeps a bridge from working on this machine, and what to do.

    finding.py   what was found, what it means, what to do
    machine.py   the one seam to this machine: files, commands, ioctl
    users.py     who the daemon runs as, and what that user may open
    health.py    clock, watchdog, disks and directories
    chips.py     GPIO chips and lines as the kernel describes them
    gpio.py      the header's chip, its lines, and the levels at boot and after a death
    ports.py     serial ports
    can.py       the kernel's CAN interfaces
    served.py    what a running daemon says, in place of its buses
    answers.py   who answers on the buses of a daemon that does not run; it only reads
    network.py   RMF's graph: interface, domain, who is there, message versions
    examination.py  every subject in turn
    kill_test.py a process that holds an output on is killed; victim.py is that process

A subject is a function that yields findings. None of them switches anything, except the kill test.
"""
