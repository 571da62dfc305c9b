import json
import math

import numpy as np

from vrsopt.report.json_value import json_value


def test_numbers_that_json_does_not_know_become_null_at_any_depth():
    content = {"fuel": math.nan, "rates": (math.inf, 1.5), "deeper": [{"mass": np.float64(-math.inf), "ok": True}]}
    text = json.dumps(json_value(content), allow_nan=False)
    assert json.loads(text) == {"fuel": None, "rates": [None, 1.5], "deeper": [{"mass": None, "ok": True}]}
