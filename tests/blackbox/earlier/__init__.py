"""Files that earlier versions wrote, one folder for each day. Nobody ever renews a folder.

`values.json` holds one specimen of each recordable type, under the type's name. Each specimen is stored
as a tree of plain values. `*.ring.gz` are daemons' rings, and `*.mcap` are the recorder's files.
`*.kept` are the memories that daemons without hardware keep on disk. `claimed-*.json` are records of
claimed outputs.
"""

from pathlib import Path

HERE = Path(__file__).parent
DAYS = sorted(path for path in HERE.iterdir() if path.name[:1].isdigit())
