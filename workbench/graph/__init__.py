"""Join RMF's graph, watch the graph, and send requests. The command-line tools for people use this
package."""
