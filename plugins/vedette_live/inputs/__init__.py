"""Where bytes come from: standard input, files that grow, sockets, brokers."""
