// One oracle for every analytic Jacobian: central differences of the function itself.
#pragma once

#include <Eigen/Core>
#include <gtest/gtest.h>

namespace pade::navigation {

/// d f(δ) / dδ at 0, with f : R^N -> R^M.
template <int M, int N, class Function>
Eigen::Matrix<double, M, N> numeric_jacobian(Function f, double h = 1e-5) {
  Eigen::Matrix<double, M, N> J;
  for (int i = 0; i < N; ++i) {
    const Eigen::Matrix<double, N, 1> step = h * Eigen::Matrix<double, N, 1>::Unit(i);
    const Eigen::Matrix<double, M, 1> after = f(step);
    const Eigen::Matrix<double, M, 1> before = f(-step);
    J.col(i) = (after - before) / (2 * h);
  }
  return J;
}

template <int M, int N, class Function>
void expect_jacobian(const Eigen::Matrix<double, M, N>& analytic, Function f, double tolerance = 1e-6) {
  const auto numeric = numeric_jacobian<M, N>(f);
  EXPECT_LT((analytic - numeric).cwiseAbs().maxCoeff(), tolerance) << "analytic\n"
                                                                   << analytic << "\nnumeric\n"
                                                                   << numeric;
}

}  // namespace pade::navigation
