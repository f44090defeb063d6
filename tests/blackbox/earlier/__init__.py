"""What earlier versions wrote to disk, a folder for each day on which it was kept. It is never renewed.

`values.json`: name -> trees, a specimen of each type that a daemon could record. `*.ring.gz`, `*.mcap`:
what a daemon's ring and the recorder held. `*.kept`: the memory of a kind without hardware.
`claimed-*.json`: records of what a daemon claimed.
"""

from pathlib import Path

HERE = Path(__file__).parent
DAYS = sorted(path for path in HERE.iterdir() if path.name[:1].isdigit())
