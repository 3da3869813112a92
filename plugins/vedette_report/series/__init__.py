"""The series of a run: what its page, its pictures and its tracks are made from."""
