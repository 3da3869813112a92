"""The recordings of the Autoferry sensor fusion benchmark."""
