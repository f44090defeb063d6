"""The daemon that serves one YAML: its loops, and the devices and subjects on these loops."""
