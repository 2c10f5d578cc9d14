"""The evidence of a drive on its truck: with the core's priors of play and neutral acceleration it is the core's own
estimate."""

from __future__ import annotations

import numpy as np
import pytest
from joint_drives import core_for, driven

from oncenter import _core
from oncenter._native import lib
from oncenter.truck.evidence import NEUTRAL, OFFSET, PLAY, TERMS, equations_of, of_theta

OF_THETA = [lib.OC_OF_OFFSET, lib.OC_OF_WIDTH, lib.OC_OF_UNLOADING]
WIDTH, WINDUP, UNLOADING = map(TERMS.index, ("WIDTH", "WINDUP", "UNLOADING"))
TIGHT = 1e-4


@pytest.mark.parametrize(
    ("base", "zero_information"), [("thesis_drive", 0.0), ("thesis_drive", 100.0), ("bypass", 0.0)]
)
def test_with_the_cores_priors_the_evidence_is_the_cores_solution_and_covariance(
    base: str, zero_information: float
) -> None:
    """`zero_information` is of a torque sensor; on the bypass some hypotheses have no creep, and so no wind-up."""
    columns, truth = driven(f'base = "{base}"\n')
    core = core_for(truth)
    core.run(columns)
    state, design = core.state().copy(), core.coefficients()["joint"]["hypothesis"]
    prior = state["tracking"]["joint"]["prior"]
    prior["zero_information"] = zero_information
    for h, solved, noise in _core.solved_hypotheses(state, design):
        equations, right = equations_of(h, solved, noise, design, prior)
        for term, mean, sd in (
            (WIDTH, h["width_mean"] - 2.0 * h["play"]["half_width"], design["scale"][WIDTH]),
            (UNLOADING, prior["unloading_mean"] - h["play"]["unloading"], prior["unloading_sd"]),
            (UNLOADING, -h["play"]["unloading"], zero_information**-0.5 if zero_information else np.inf),
        ):
            equations[1 + term, 1 + term] += (design["scale"][term] / sd) ** 2
            right[1 + term] += design["scale"][term] * mean / sd**2
        linear, constant = of_theta(h, design)
        covariance = np.linalg.inv(linear.T @ equations @ linear)
        found = covariance @ linear.T @ (right - equations @ constant)
        play, variances = h["play"], h["variances"]["of"][OF_THETA].astype(float)
        width = 2.0 * play["half_width"] + h["terms"][WIDTH] * design["scale"][WIDTH]
        if play["friction"] >= 0.0:
            width += 2.0 * play["windup"] + h["terms"][WINDUP] * design["scale"][WINDUP]
        else:
            variances[PLAY] -= design["scale"][WINDUP] ** 2
        sd = np.sqrt(variances)
        np.testing.assert_allclose(found[:3] / sd, np.array([h["offset"], width, h["unloading"]]) / sd, atol=TIGHT)
        np.testing.assert_allclose(np.sqrt(np.diag(covariance)[:3]), sd, rtol=TIGHT)
        correlation = covariance[OFFSET, [PLAY, NEUTRAL]] / (sd[OFFSET] * sd[[PLAY, NEUTRAL]])
        of_core = h["offset_covariance"][OF_THETA[1:]] / (sd[OFFSET] * sd[[PLAY, NEUTRAL]])
        np.testing.assert_allclose(correlation, of_core, atol=TIGHT)
