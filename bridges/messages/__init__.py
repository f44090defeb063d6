"""RMF's messages: definitions, bytes, topics and QoS, and substitutes for messages that a release
lacks."""
