"""A program that runs a command and prints the imported modules.

Usage: `python -m tests.blackbox.imported run FILE …`.
"""

import sys

from bridges.cli import main

LIBRARIES = ("mcap", "rosbags", "zstandard", "lz4", "numpy")

if __name__ == "__main__":
    code = main()
    found = sorted({name.partition(".")[0] for name in sys.modules} & set(LIBRARIES))
    sys.stderr.write(f"imported {found}\n")
    sys.exit(code)
