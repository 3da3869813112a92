"""Which of Q and R is likely wrong, and by how much: worlds with other noises, their innovations, and what explains them."""

from vedette_report.whole_trackers.culprits.words import likely_cause as likely_cause
