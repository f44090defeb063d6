"""The daemon that serves one YAML. It has loops, and devices or subjects on these loops."""
