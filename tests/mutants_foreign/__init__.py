"""Wrong components, as authors of plugins would get them wrong, written without knowledge of the laws."""
