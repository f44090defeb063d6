"""The way to Open-RMF: message definitions, topic names, QoS, and the transports."""
