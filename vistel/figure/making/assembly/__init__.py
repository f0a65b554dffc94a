"""One figure assembled from pieces of several meshes."""
