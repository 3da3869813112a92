"""Results for people: the picture, the errors over time, and the summary. Needs matplotlib where it draws."""
