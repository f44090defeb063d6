"""Incidents of the soak as the recorder writes them; `python -m tests.recording.corpus` renews them."""
