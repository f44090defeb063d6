"""RMF's messages: definitions, bytes, topics and QoS. Some releases of RMF lack a message, so a
substitute for it is here too."""
