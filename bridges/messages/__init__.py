"""RMF's messages: definitions, bytes, topic names and QoS, and the gaps of each release."""
