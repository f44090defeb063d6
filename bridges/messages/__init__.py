"""RMF's messages: definitions, bytes, topic names and QoS, and what each release lacks."""
