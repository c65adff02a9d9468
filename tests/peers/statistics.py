"""What SciPy, statsmodels, pingouin and NumPy find for the data of `src/result/statistics/mod.rs`.

    python3 -m venv venv && venv/bin/pip install scipy statsmodels pandas pingouin
    venv/bin/python tests/peers/statistics.py            # checks the values committed in the tests
    venv/bin/python tests/peers/statistics.py --print    # prints them

Committed values were made with SciPy, statsmodels and pingouin; a difference beyond 1e-9 relative exits 1.
"""

import pathlib
import re
import sys

# Peers import the standard module that this file's name would hide.
sys.path.pop(0)

try:
    import numpy as np
    import pandas as pd
    import pingouin
    import scipy.stats
    import statsmodels.api as sm
    from statsmodels.stats.anova import AnovaRM
except ImportError as missing:
    sys.exit(f"skipped: {missing}; pip install scipy statsmodels pandas pingouin")

ROOT = pathlib.Path(__file__).resolve().parents[2] / "src/result/statistics"


def data():
    text = (ROOT / "mod.rs").read_text()
    found = re.findall(r"pub const (\w): \[f64; 8\] = \[(.*?)\]", text, re.S)
    return {name: np.array([float(v) for v in values.split(",") if v.strip()]) for name, values in found}


def expected():
    d = data()
    fit = sm.OLS(d["A"], sm.add_constant(d["X"])).fit()
    line = scipy.stats.linregress(d["X"], d["A"])
    assert abs(line.slope / fit.params[1] - 1) < 1e-12 and abs(line.pvalue / fit.pvalues[1] - 1) < 1e-9
    difference = d["A"] - d["B"]
    bias, sd = difference.mean(), difference.std(ddof=1)
    long = pd.DataFrame(
        [(s, m, d[m][s]) for m in "ABC" for s in range(8)], columns=["specimen", "method", "value"]
    )
    table = AnovaRM(long, "value", "specimen", within=["method"]).fit().anova_table
    corrected = pingouin.rm_anova(long, dv="value", within="method", subject="specimen", correction=True).iloc[0]
    epsilon = pingouin.epsilon(long, dv="value", within="method", subject="specimen", correction="gg")
    f = table["F Value"].iloc[0]
    p_gg = scipy.stats.f.sf(f, 2 * epsilon, 14 * epsilon)
    reported = next(corrected[name] for name in corrected.index if name.lower() in ("p-gg-corr", "p_gg_corr"))
    assert abs(reported / p_gg - 1) < 1e-9, (reported, p_gg)
    q1, q2, q3 = np.percentile(d["A"], [25, 50, 75])
    return {
        "regression.rs": {
            "REG_SLOPE": fit.params[1],
            "REG_INTERCEPT": fit.params[0],
            "REG_R2": fit.rsquared,
            "REG_SLOPE_SE": fit.bse[1],
            "REG_INTERCEPT_SE": fit.bse[0],
            "REG_SLOPE_P": fit.pvalues[1],
            "REG_INTERCEPT_P": fit.pvalues[0],
        },
        "agreement.rs": {
            "BA_BIAS": bias,
            "BA_SD": sd,
            "BA_LOWER": bias - 1.96 * sd,
            "BA_UPPER": bias + 1.96 * sd,
            "BA_P": scipy.stats.ttest_rel(d["A"], d["B"]).pvalue,
        },
        "anova.rs": {"RM_F": table["F Value"].iloc[0], "RM_P": table["Pr > F"].iloc[0], "GG_EPSILON": epsilon, "GG_P": p_gg},
        "quartiles.rs": {"Q_1": q1, "Q_2": q2, "Q_3": q3},
    }


def main():
    wrong = 0
    for file, values in expected().items():
        text = (ROOT / file).read_text()
        for name, value in values.items():
            if "--print" in sys.argv:
                print(f"{file}: const {name}: f64 = {float(value)!r};")
                continue
            committed = float(re.search(rf"const {name}: f64 = (\S+);", text).group(1))
            fine = abs(committed / value - 1) < 1e-9
            wrong += not fine
            print(f"{'ok' if fine else 'WRONG'} {name}: committed {committed!r}, peers {float(value)!r}")
    sys.exit(wrong > 0)


main()
