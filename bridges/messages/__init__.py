"""RMF's messages: definitions, bytes, topics and QoS, and other messages in place of those that a
release of RMF lacks."""
