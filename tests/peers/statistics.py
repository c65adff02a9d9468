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
    import scipy.optimize
    import scipy.stats
    import statsmodels.api as sm
    from statsmodels.stats.meta_analysis import effectsize_smd
    from statsmodels.stats.multitest import multipletests
    from statsmodels.stats.weightstats import CompareMeans, DescrStatsW
    from statsmodels.stats.anova import AnovaRM
except ImportError as missing:
    sys.exit(f"skipped: {missing}; pip install scipy statsmodels pandas pingouin")

ROOT = pathlib.Path(__file__).resolve().parents[2] / "src/result/statistics"


def data():
    text = (ROOT / "mod.rs").read_text()
    found = re.findall(r"pub const (\w): \[f64; 8\] = \[(.*?)\]", text, re.S)
    return {name: np.array([float(v) for v in values.split(",") if v.strip()]) for name, values in found}


def groups(d):
    """Two independent groups: A[:5] and B[3:]."""
    a, b = d["A"][:5], d["B"][3:]
    test = scipy.stats.ttest_ind(a, b, equal_var=False)
    means = CompareMeans(DescrStatsW(a), DescrStatsW(b))
    low, high = means.tconfint_diff(usevar="unequal")
    assert abs(means.ttest_ind(usevar="unequal")[1] / test.pvalue - 1) < 1e-9
    n = len(a) + len(b)
    pooled = np.sqrt(((len(a) - 1) * a.var(ddof=1) + (len(b) - 1) * b.var(ddof=1)) / (n - 2))
    g, _ = effectsize_smd(a.mean(), a.std(ddof=1), len(a), b.mean(), b.std(ddof=1), len(b))
    scale = np.sqrt(1 / len(a) + 1 / len(b))
    t = (a.mean() - b.mean()) / pooled / scale
    place = lambda share: scipy.optimize.brentq(
        lambda nc: scipy.stats.nct.cdf(t, n - 2, nc) - share, t - 8, t + 8, xtol=1e-14, rtol=1e-14
    )
    j = 1 - 3 / (4 * n - 9)
    exact = scipy.stats.mannwhitneyu(a, b, alternative="two-sided")
    tied = scipy.stats.mannwhitneyu(np.round(a / 20), np.round(b / 20), alternative="two-sided")
    holm = multipletests([0.02, 0.011, 0.5, 0.012], method="holm")[1]
    one = DescrStatsW(d["A"])
    interval = one.tconfint_mean()
    return {
        "summary.rs": {
            "SUM_MEAN": one.mean,
            "SUM_SD": d["A"].std(ddof=1),
            "SUM_LOW": interval[0],
            "SUM_HIGH": interval[1],
        },
        "student.rs": {
            "T_QUANTILE_7": scipy.stats.t.ppf(0.975, 7),
            "T_QUANTILE_2_5": scipy.stats.t.ppf(0.975, 2.5),
            "NCT_CDF": scipy.stats.nct.cdf(2.0, 5, 1.2),
            "NCT_CDF_NEGATIVE": scipy.stats.nct.cdf(-0.4, 14, 0.7),
        },
        "welch.rs": {
            "W_DIFFERENCE": a.mean() - b.mean(),
            "W_LOW": low,
            "W_HIGH": high,
            "W_T": test.statistic,
            "W_FREEDOM": test.df,
            "W_P": test.pvalue,
            "HG_G": g,
            "HG_LOW": j * scale * place(0.975),
            "HG_HIGH": j * scale * place(0.025),
        },
        "mann_whitney.rs": {
            "MW_U": exact.statistic,
            "MW_P": exact.pvalue,
            "MW_TIED_U": tied.statistic,
            "MW_TIED_P": tied.pvalue,
        },
        "holm.rs": {f"HOLM_{i + 1}": p for i, p in enumerate(holm)},
    }


def expected():
    d = data()
    fit = sm.OLS(d["A"], sm.add_constant(d["X"])).fit()
    line = scipy.stats.linregress(d["X"], d["A"])
    assert abs(line.slope / fit.params[1] - 1) < 1e-12 and abs(line.pvalue / fit.pvalues[1] - 1) < 1e-9
    difference = d["A"] - d["B"]
    bias, sd = difference.mean(), difference.std(ddof=1)
    both = (d["A"] + d["B"]) / 2
    percent = 100 * difference / both
    tested = scipy.stats.linregress(both, percent)
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
    return groups(d) | {
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
            "BA_PERCENT": percent.mean(),
            "BA_PERCENT_SD": percent.std(ddof=1),
            "BA_PERCENT_LOWER": percent.mean() - 1.96 * percent.std(ddof=1),
            "BA_PERCENT_UPPER": percent.mean() + 1.96 * percent.std(ddof=1),
            "BA_SLOPE": tested.slope,
            "BA_SLOPE_P": tested.pvalue,
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
