"""The examples of papers are the filters of their studies."""

import pytest

import vedette
from support.paths import EXAMPLES
from vedette_bayes_risk.configs import CONTESTED
from vedette_bayes_risk.configs import FILTERS as BAYES_RISK
from vedette_target_oriented.configs import FILTERS as TARGET_ORIENTED
from vedette_vts.configs import FILTERS as VTS

STUDIES = {"bayes_risk": BAYES_RISK | CONTESTED, "target_oriented": TARGET_ORIENTED, "vts": VTS}


@pytest.mark.parametrize("study", STUDIES)
def test_each_example_is_one_filter_of_the_study_and_each_filter_has_one(study):
    examples = [vedette.to_config(vedette.load(path)) for path in sorted((EXAMPLES / study).glob("*.toml"))]
    filters = [vedette.to_config(vedette.load(config)) for config in STUDIES[study].values()]
    assert [example for example in examples if filters.count(example) != 1] == []
    assert [one for one in filters if examples.count(one) != 1] == []
