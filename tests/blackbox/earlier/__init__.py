"""Files that earlier versions wrote, one folder for each day. Nobody ever renews a folder.

`values.json` holds a specimen of each recordable type as a tree, under the type's name. `*.ring.gz` are
daemons' rings, `*.mcap` are the recorder's files, and `*.kept` are memories of kinds without hardware.
`claimed-*.json` are records of claimed outputs.
"""

from pathlib import Path

HERE = Path(__file__).parent
DAYS = sorted(path for path in HERE.iterdir() if path.name[:1].isdigit())
