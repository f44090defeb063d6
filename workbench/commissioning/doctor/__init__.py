"""`rmf-bridge doctor`: find and explain the obstacles to a working bridge on this machine.

    finding.py   a finding: fact, meaning, remedy
    machine.py   the only access to this machine: files, commands, ioctl
    users.py     the daemon's user and its access to devices
    health.py    clock, watchdog, disks and directories
    chips.py     GPIO chips and lines as the kernel describes them
    gpio.py      the header's chip and lines; levels at boot and after the daemon dies
    ports.py     serial ports
    can.py       the kernel's CAN interfaces
    served.py    a running daemon's status; the doctor then does not read the daemon's buses
    answers.py   devices that answer on the buses while no daemon runs; reads only
    network.py   RMF's graph: interface, domain, nodes present, message versions
    examination.py  runs the examination of every subject in turn
    hardening.py the points of docs/how-to/harden.md, with `--hardening`
    kill_test.py kills a process (victim.py) that holds an output on

A subject is a function that yields findings. Only the kill test switches an output.
"""
