"""Bayes-risk detection over several sensors, association weights from it, and the study of their paper."""

from collections.abc import Iterable

import vedette
from vedette_bayes_risk.associator import BayesRisk
from vedette_bayes_risk.by_count import BayesRiskByCount
from vedette_bayes_risk.clustered import ClusteredDetection
from vedette_bayes_risk.decision import BayesRiskDecision
from vedette_bayes_risk.likelihood import CountLikelihoodDetection
from vedette_bayes_risk.parallel import ParallelKalmanPrinted
from vedette_bayes_risk.printed import BayesRiskPrinted
from vedette_bayes_risk.reproduction import BayesRiskReproduction
from vedette_bayes_risk.tail import BayesRiskDetection

VEDETTE_CONTRACT = 2


@vedette.plugin
def vedette_components() -> Iterable[type[vedette.Component]]:
    """Return every component of this package."""
    return [
        *(BayesRiskDetection, BayesRiskPrinted, CountLikelihoodDetection),
        *(BayesRiskByCount, BayesRiskDecision, ClusteredDetection),
        *(BayesRisk, ParallelKalmanPrinted, BayesRiskReproduction),
    ]
