"""What a map shows: its plane, what sensors see of it, gates on it."""
