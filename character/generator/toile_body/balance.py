"""Weights that give samples wanted first and second moments (entropy balancing, Hainmueller 2012)."""

import numpy as np

RIDGE = 1e-3  # keeps the weights of a small sample tame; in units of the standardised moments
STEPS = 60


def balance(x, mean, covariance):
    """Weights (sum 1) nearest to equal ones under which the rows of x have this mean and covariance (nearly)."""
    root = np.linalg.inv(np.linalg.cholesky(covariance))
    z = (x - mean) @ root.T  # wanted: mean 0, covariance identity
    upper = np.triu_indices(z.shape[1])
    features = np.concatenate([z, z[:, upper[0]] * z[:, upper[1]] - np.eye(z.shape[1])[upper]], 1)
    dual = np.zeros(features.shape[1])
    for _ in range(STEPS):
        w = softmax(-features @ dual)
        gradient = w @ features - RIDGE * dual
        centred = features - w @ features
        hessian = (centred * w[:, None]).T @ centred + RIDGE * np.eye(len(dual))
        step = np.linalg.solve(hessian, gradient)
        dual += step * min(1.0, 1.0 / np.abs(step).max())
    return softmax(-features @ dual)


def softmax(a):
    """Normalised exponentials."""
    e = np.exp(a - a.max())
    return e / e.sum()
