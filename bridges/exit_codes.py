"""The exit codes of each subcommand, for `--help`, the manual page and docs/reference/exit-codes.md.

sysexits.h defines the meaning of codes from 64 on.
"""

from typing import Final

ALWAYS: Final = {
    2: "wrong command line",
    69: "the package that has this command is not installed",
    141: "the reader of the output has gone",
}
"""The exit codes that every subcommand has."""
YAML: Final = {78: "the YAML has an error"}
ROOT: Final = {
    66: "the folder of `--root` is missing",
    74: "a file was not written",
    77: "not root",
}
SYSTEMS: Final = (
    "a program of systemd is missing, or failed and said why; other codes of it are possible"
)
GRAPH: Final = "nothing was heard, or the graph cannot be joined"
RECORDING: Final = {66: "the recording cannot be read"}
SIMULATION: Final = {
    0: "done",
    1: "the simulation refused the order",
    64: "no such device",
    69: "no simulation of this file runs",
    **YAML,
}
ORDERED: Final = {
    4: "the order was refused (the reason is printed)",
    69: "the order cannot be written, the daemon does not answer, or this user may not see it or send"
    " it a signal",
}
SENT: Final = {
    0: "the effect was seen",
    1: "no effect was seen (the reason is printed), or the graph cannot be joined",
    130: "Ctrl-C",
}

EXIT_CODES: Final[dict[str, dict[int, str]]] = {
    "init": {
        0: "the file is written",
        64: "answers are missing, or contradict each other",
        66: "the map cannot be read",
        73: "the file exists, or cannot be written",
        130: "Ctrl-C",
    },
    "run": {
        0: "ended by a signal, every output verified off",
        1: "ended by a signal, an output not verified off",
        64: "invalid combination of options, or `--simulate` in a service",
        69: "another process serves these devices, or the transport or hardware is not there",
        70: "ended by a defect",
        78: "the YAML has an error, or no longer fits the service's drop-in",
    },
    "check": {
        0: "no error (there may be warnings)",
        73: "the sheet cannot be written",
        78: "a file has an error, or the files contradict each other",
    },
    "migrate": {
        0: "the file has no old key, or --dry-run has printed the changes",
        65: "an old key must be changed by hand",
        73: "the file cannot be written",
        **YAML,
    },
    "enable": {
        0: "the service runs",
        1: SYSTEMS,
        69: "an output is not verified off, or a daemon that a person started serves the file",
        **ROOT,
        78: "the YAML or a file that it names has an error, or it contradicts another service's YAML",
    },
    "backup": {
        0: "saved, or restored and every service runs",
        1: SYSTEMS,
        65: "an enabled service has no YAML in the backup, so it cannot be restored",
        **ROOT,
        66: "FILE is no backup, the backup lacks a file that cannot be read, or the folder of `--root`"
        " is missing",
        69: "an output is not verified off",
        73: "a file cannot be written, or FILE exists",
        78: "a restored YAML, or a file that it names, has an error",
    },
    "disable": {
        0: "the service has ended",
        1: SYSTEMS,
        64: "there is no service of this name",
        69: "an output is not verified off",
        **ROOT,
    },
    "schema": {0: "printed"},
    "watch": {0: "Ctrl-C, or `--once` heard something", 1: GRAPH},
    "page": {
        0: "Ctrl-C or SIGTERM",
        64: "the page would show the site to strangers, or the two typed passwords differ",
        **RECORDING,
        69: "the port is taken, or NiceGUI is not installed",
        78: "the password file has an error",
    },
    "mqtt-out": {
        0: "Ctrl-C or SIGTERM",
        1: "the graph cannot be joined, or was lost",
        64: "the password would go over the network unencrypted",
        69: "paho-mqtt is not installed",
        78: "the password file or the certificate has an error",
    },
    "exporter": {
        0: "Ctrl-C or SIGTERM",
        1: GRAPH,
        69: "the port is taken, or prometheus_client is not installed",
    },
    "notify": {
        0: "Ctrl-C or SIGTERM, or every test notice was taken",
        1: f"{GRAPH}, or a test notice was not taken",
        73: "--ack cannot be written",
        77: "this user may not acknowledge troubles of the service",
        78: "the file of recipients has an error",
    },
    "status": {
        0: "all is well",
        1: "a daemon has a fault",
        2: "a daemon died or is silent",
        3: "there is no such daemon, or this user may not see one",
        4: "with --idle: a device is in use, or nobody knows whether a device is in use",
    },
    "doctor": {
        0: "all is well",
        1: "warnings, or facts that cannot be seen (`--hardening`)",
        2: "something is wrong",
        64: "the kill test was not confirmed, or there is no such output",
        73: "the form cannot be written",
        **YAML,
        130: "Ctrl-C",
    },
    "explain": {0: "explained", 1: "the device was not heard, or the graph cannot be joined"}
    | RECORDING,
    "plot": {0: "drawn", 1: "nothing to draw, or the picture cannot be written"} | RECORDING,
    "send": SENT,
    "judge": {
        0: "every observed law is kept",
        1: "a law is broken",
        **RECORDING,
        69: f"{GRAPH}, or the play was not performed",
        73: "the JUnit file cannot be written",
    },
    "release": SENT,
    "reset": {
        0: "every device has taken the reset",
        1: "no daemon runs, or the file has no such device",
        **ORDERED,
    },
    "drill": {0: "the drill has begun, or has ended", 1: "no daemon runs", **ORDERED},
    "workcell": {
        0: "the decision was obeyed",
        1: "no daemon runs, or nothing is in doubt",
        **ORDERED,
    },
    "walk": {
        0: "every output is off",
        1: "an output is not verified off",
        64: "no terminal, or no such device that can be tested",
        69: "the device is in use, or does not answer",
        73: "the record cannot be written",
        **YAML,
    },
    "press": SIMULATION,
    "fail": SIMULATION,
    "log": {
        0: "journalctl's own codes",
        69: "there is no journal, or the daemon does not log to the journal",
    },
    "incident": {
        0: "the recording is written",
        65: "the recording's YAML cannot be made anonymous",
        69: "no ring can be read, or the library is missing",
        73: "the recording cannot be written",
    },
    "recorder": {
        0: "SIGTERM or Ctrl-C",
        69: "the library is missing",
        77: "this user may not read the counts of the service",
    },
    "replay": {
        0: "every decision is the same",
        1: "a decision differs",
        65: "the decisions of the recording cannot be repeated",
        **RECORDING,
        **YAML,
    },
    "completion": {0: "printed"},
    "outputs-off": {
        0: "every output is verified off",
        1: "an output is not verified off",
        69: "the daemon runs, or may run",
        **YAML,
    },
}


def told(command: str) -> str:
    """Return a subcommand's exit codes as one line, for `--help`."""
    return "; ".join(f"{code} {text}" for code, text in EXIT_CODES[command].items())
