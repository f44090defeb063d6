"""Files that earlier versions wrote, a folder for each day. A folder is never renewed.

`values.json` has a specimen of each recordable type, as trees, by the type's name. `*.ring.gz` are
daemons' rings, `*.mcap` the recorder's files, `*.kept` the memory of kinds without hardware.
`claimed-*.json` are records of claimed outputs.
"""

from pathlib import Path

HERE = Path(__file__).parent
DAYS = sorted(path for path in HERE.iterdir() if path.name[:1].isdigit())
