"""Where tracks go: standard output, files, sockets, brokers, browsers."""
