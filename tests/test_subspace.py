import naive
import numpy as np
import pytest

from gsfdi.subspace import (
    StateSpace,
    angles,
    excitation,
    factor,
    hankel_factor,
    lagged_gram,
    markov,
    moesp,
    observability,
    pbsid,
)

A = np.array([[0.95, 0.25, 0.0], [-0.25, 0.95, 0.1], [0.0, 0.0, 0.7]]) * 0.98
B = np.array([[0.0], [1.0], [0.5]])
C = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 1.0]])


def run(n: int, noise: float = 0.0, gain: float = 0.0, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Input and output, under feedback of the first noisy output when `gain` is not zero."""
    rng = np.random.default_rng(seed)
    u, y, x = np.zeros((n, 1)), np.zeros((n, 2)), np.zeros(3)
    excite, v, w = rng.standard_normal(n), noise * rng.standard_normal((n, 2)), noise * rng.standard_normal((n, 3))
    for k in range(n):
        y[k] = C @ x + v[k]
        u[k] = excite[k] - gain * y[k, 0]
        x = A @ x + B[:, 0] * u[k, 0] + w[k]
    return u, y


@pytest.mark.parametrize(("channels", "n", "lags"), [(1, 30, 5), (3, 200, 8), (2, 3000, 17)])
def test_the_gram_is_that_of_the_hankel_matrix(channels: int, n: int, lags: int) -> None:
    w = np.random.default_rng(1).standard_normal((channels, n))
    H = naive.hankel(w, lags)
    assert lagged_gram(w, lags) == pytest.approx(H @ H.T, rel=1e-11, abs=1e-9)


def test_the_blocked_factor_is_that_of_the_hankel_matrix() -> None:
    w = np.random.default_rng(2).standard_normal((2, 9000))
    R = hankel_factor(w, 6)
    assert pytest.approx(lagged_gram(w, 6), rel=1e-10, abs=1e-8) == R.T @ R


def test_moesp_finds_the_observability_matrix() -> None:
    u, y = run(20_000, noise=1e-4)
    found = moesp(u, y, 8, 3)
    assert angles(observability(A, C, 8), found.basis)[0] < 1e-3
    assert found.fast


@pytest.mark.parametrize("decibel", [120, 180, 1000])
def test_clean_data_falls_back_to_the_exact_factor(decibel: int) -> None:
    u, y = run(8000, noise=10 ** (-decibel / 20))
    found = moesp(u, y, 8, 3)
    assert not found.fast
    assert angles(observability(A, C, 8), found.basis)[0] < max(30 * 10 ** (-decibel / 20), 1e-10)


def test_stretches_add() -> None:
    u, y = run(4000, noise=1e-3)
    parts = moesp([u[:1500], u[1500:]], [y[:1500], y[1500:]], 8, 3)
    assert angles(moesp(u, y, 8, 3).basis, parts.basis)[0] < 1e-2


def test_feedback_biases_moesp_and_not_pbsid() -> None:
    u, y = run(60_000, noise=0.3, gain=0.06)
    truth = observability(A, C, 8)
    w = np.column_stack([u, y]).T
    found = pbsid(lagged_gram(w, 31), 1, 2, 12, 3)
    closed = angles(truth, observability(found.A, found.C, 8))[0]
    opened = angles(truth, moesp(u, y, 8, 3).basis)[0]
    assert closed < 0.02
    assert opened > 2 * closed


def test_angles_agree_with_the_cosines_where_these_can_see() -> None:
    rng = np.random.default_rng(3)
    a, b = (np.linalg.qr(rng.standard_normal((10, 3)))[0] for _ in range(2))
    assert angles(a, b) == pytest.approx(naive.angles(a, b), abs=1e-12)


@pytest.mark.parametrize("size", [1e-3, 1e-7, 1e-11])
def test_small_angles_are_not_lost(size: float) -> None:
    a = np.eye(6)[:, :2]
    b = a.copy()
    b[:, 0] = np.cos(size) * a[:, 0] + np.sin(size) * np.eye(6)[:, 4]
    assert angles(a, b)[0] == pytest.approx(size, rel=1e-6)


def test_angles_are_blind_to_b_and_the_second_step_is_not() -> None:
    weak = StateSpace(A, 0.9 * B, C, np.zeros((3, 2)))
    whole = StateSpace(A, B, C, np.zeros((3, 2)))
    assert angles(observability(weak.A, weak.C, 8), observability(whole.A, whole.C, 8))[0] < 1e-12
    assert markov(weak, 5) == pytest.approx(0.9 * markov(whole, 5))


def test_a_smooth_command_excites_little() -> None:
    t = np.arange(4000) * 0.01
    slow = np.column_stack([np.sin(t), np.cos(t), np.sin(t)]).T
    quick = np.random.default_rng(5).standard_normal((3, 4000))
    assert excitation(lagged_gram(slow, 10), 3, 4000) < 1e-3 * excitation(lagged_gram(quick, 10), 3, 4000)
    assert excitation(lagged_gram(quick, 10), 3, 4000) == pytest.approx(np.sqrt(6.0), rel=0.05)


def test_a_gram_that_is_no_use_is_noticed() -> None:
    w = np.tile(np.sin(np.arange(500) * 0.01), (2, 1))
    assert not factor([w], 4, np.arange(8), 8).fast
