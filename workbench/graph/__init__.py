"""Join RMF's graph, watch the graph, and send requests. The commands that people use need this
package."""
