"""RMF's messages: definitions, bytes, topic names, QoS, and the messages that each release lacks."""
