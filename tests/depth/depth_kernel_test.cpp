#include "pade/depth/depth_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "pade/core/pose.hpp"
#include "pade/core/random.hpp"
#include "pade/depth/derotation.hpp"

namespace pade::depth {
namespace {

constexpr std::size_t kCount = 1003;  // not a multiple of any vector length

struct Row {
  std::vector<float> x = std::vector<float>(kCount), flow = std::vector<float>(2 * kCount),
                     sigma = std::vector<float>(kCount);
  std::vector<std::uint8_t> gate = std::vector<std::uint8_t>(kCount);
  float y = 31;
};

struct Output {
  std::vector<float> depth = std::vector<float>(kCount), variance = std::vector<float>(kCount),
                     own_variance = std::vector<float>(kCount), bound = std::vector<float>(kCount);
  std::vector<std::uint8_t> state = std::vector<std::uint8_t>(kCount);
};

Row random_row(Random& random) {
  Row row;
  for (std::size_t i = 0; i < kCount; ++i) {
    row.x[i] = static_cast<float>(i) - 500.5F;
    row.flow[2 * i] = static_cast<float>(random.uniform(-20, 20));
    row.flow[2 * i + 1] = static_cast<float>(random.uniform(-2, 2));
    row.sigma[i] = static_cast<float>(random.uniform(0.05, 1));
    if (i % 17 == 0) row.flow[2 * i] = std::nanf("");
    if (i % 19 == 0) row.sigma[i] = INFINITY;
    if (i % 23 == 0) row.gate[i] = 3;
    if (i % 29 == 0) row.gate[i] = 5;
  }
  return row;
}

KernelParameters random_parameters(Random& random) {
  KernelParameters k{};
  k.fx = k.fy = 554.26F;
  k.inverse_fx = k.inverse_fy = 1 / 554.26F;
  k.fx_tx = static_cast<float>(554.26 * random.uniform(-0.2, 0.2));
  k.fy_ty = static_cast<float>(554.26 * random.uniform(-0.2, 0.2));
  k.tz = static_cast<float>(random.uniform(-0.2, 0.2));
  const double w[3] = {random.uniform(-0.03, 0.03), random.uniform(-0.03, 0.03), random.uniform(-0.03, 0.03)};
  const double turn[9] = {0, -w[2], w[1], w[2], 0, -w[0], -w[1], w[0], 0};  // to first order is enough here
  for (int i = 0; i < 9; ++i) {
    k.turn[i] = static_cast<float>(turn[i]);
    k.view[i] = static_cast<float>(-turn[i]);
  }
  for (int i = 0; i < 3; ++i) k.omega[i] = static_cast<float>(w[i]);
  k.add_tz = k.tz;
  k.sigma2 = 0.09F;
  k.sigma_scale2 = 1;
  k.parallax2 = 9;
  k.residual2 = 25;
  k.tangent2 = 0.06F;
  k.blind2 = 1;
  k.epipole2 = 4;
  k.range = 40;
  k.left = -500.5F;
  k.right = 500.5F;
  k.top = -240;
  k.bottom = 240;
  k.bound_k = static_cast<float>(random.uniform(1, 4));
  k.relative2 = static_cast<float>(random.uniform(0, 1e-4));
  k.sigma_scale2 = static_cast<float>(random.uniform(0.5, 2));
  Matrix6d root;  // of the covariance: millimetres and milliradians, in any direction
  for (int i = 0; i < 36; ++i) root(i / 6, i % 6) = 1e-3 * random.normal();
  const Matrix6d covariance = root * root.transpose();
  int index = 0;
  for (int r = 0; r < 6; ++r) {
    for (int c = r; c < 6; ++c) k.pose[index++] = static_cast<float>(covariance(r, c));
  }
  return k;
}

/// The kernel's arithmetic in a few lines of double precision: the slow twin.
struct Twin {
  double z;      // depth whether or not it is published
  double bound;  // NaN = none
};

Eigen::Vector2d turned(const float* turn, const Camera& camera, const Eigen::Vector2d& p) {
  Eigen::Matrix3d rotation;
  for (int i = 0; i < 9; ++i) rotation(i / 3, i % 3) = static_cast<double>(turn[i]) + (i % 4 == 0 ? 1 : 0);
  const Eigen::Vector3d b = rotation * Eigen::Vector3d(p.x() / camera.fx, p.y() / camera.fy, 1);
  return {camera.fx * b.x() / b.z(), camera.fy * b.y() / b.z()};
}

Matrix6d pose_covariance(const KernelParameters& k) {
  Matrix6d covariance;
  int index = 0;
  for (int r = 0; r < 6; ++r) {
    for (int c = r; c < 6; ++c) covariance(r, c) = covariance(c, r) = static_cast<double>(k.pose[index++]);
  }
  return k.has_pose ? covariance : Matrix6d::Zero();
}

Twin twin(const KernelParameters& k, const Row& row, std::size_t i, bool with_sigma) {
  const Camera camera{0, 0, k.fx, k.fy, 0, 0};
  const Eigen::Vector3d t(k.fx_tx / k.fx, k.fy_ty / k.fy, k.tz);
  const Eigen::Vector2d p(row.x[i], row.y);
  const Eigen::Vector2d w(row.flow[2 * i], row.flow[2 * i + 1]);
  Eigen::Vector2d d = w;
  Eigen::Vector2d match = p + w;
  if (k.derotation == KernelDerotation::first_order) {
    d += times_B(camera, p, {k.omega[0], k.omega[1], k.omega[2]});
  } else if (k.derotation != KernelDerotation::none) {
    d = turned(k.turn, camera, p + w) - p;
  }
  if (k.derotation == KernelDerotation::none || k.derotation == KernelDerotation::remaining) {
    match = turned(k.view, camera, p + w);
  }
  const Eigen::Vector2d a = -times_A(camera, p, t);
  const double ad = a.dot(d);
  Twin out{(k.samelson ? ad / d.squaredNorm() : a.squaredNorm() / ad) + k.add_tz,
           std::numeric_limits<double>::quiet_NaN()};

  // Z_min = max(|a| - k sigma_a, 0) / (seen + k sigma) + t_z.
  const double flow_sigma2 =
      (with_sigma ? static_cast<double>(k.sigma_scale2) * row.sigma[i] * row.sigma[i] : k.sigma2) +
      k.relative2 * d.squaredNorm();
  const Matrix6d covariance = pose_covariance(k);
  Eigen::Matrix<double, 2, 3> A;
  Eigen::Matrix<double, 2, 3> B;
  for (int axis = 0; axis < 3; ++axis) {
    A.col(axis) = times_A(camera, p, Eigen::Vector3d::Unit(axis));
    B.col(axis) = times_B(camera, p + d, Eigen::Vector3d::Unit(axis));
  }
  const double sigma_a = std::sqrt((A * covariance.topLeftCorner<3, 3>() * A.transpose()).trace());
  const Eigen::Vector2d direction = a.normalized();
  const double by_rotation =
      direction.dot(B * covariance.bottomRightCorner<3, 3>() * B.transpose() * direction);
  const bool directed = a.norm() >= 6 * sigma_a;
  const double along = direction.dot(d);
  const double across = direction.x() * d.y() - direction.y() * d.x();
  const double seen = directed ? std::max(along, 0.0) : d.norm();
  const double least = std::max(a.norm() - k.bound_k * sigma_a, 0.0);
  const double bound = least / (seen + k.bound_k * std::sqrt(flow_sigma2 + by_rotation)) + k.add_tz;
  const bool inside =
      match.x() >= k.left && match.x() <= k.right && match.y() >= k.top && match.y() <= k.bottom;
  const bool consistent = !directed || across * across <= k.residual2 * flow_sigma2 ||
                          across * across <= k.tangent2 * along * along;
  const bool behind = directed && along < 0 && along * along > k.parallax2 * flow_sigma2;
  if (row.gate[i] == 0 && inside && consistent && !behind && least > 0 && bound > 0 && flow_sigma2 < 1e6) {
    out.bound = bound;
  }
  return out;
}

using Kernel = decltype(&baseline::depth_row);
Output run(Kernel kernel, const KernelParameters& k, const Row& row, bool with_sigma) {
  Output out;
  kernel(
      k, row.x.data(), row.y, row.flow.data(), with_sigma ? row.sigma.data() : nullptr, row.gate.data(),
      kCount,
      {out.depth.data(), out.variance.data(), out.own_variance.data(), out.bound.data(), out.state.data()});
  return out;
}

bool same_bits(const std::vector<float>& a, const std::vector<float>& b) {
  return std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

TEST(DepthKernel, EveryInstructionSetGivesTheSameBitsAndAgreesWithItsSlowTwin) {
  Random random(3);
  int measured = 0;
  int bounded = 0;
  int on_the_brink = 0;
  for (int trial = 0; trial < 64; ++trial) {
    const Row row = random_row(random);
    KernelParameters k = random_parameters(random);
    k.derotation = static_cast<KernelDerotation>(trial % 4);
    k.samelson = (trial / 4) % 2 == 1;
    k.has_pose = (trial / 8) % 2 == 1;
    const bool with_sigma = (trial / 16) % 2 == 1;
    const Output slow = run(&baseline::depth_row, k, row, with_sigma);
    for (const auto set : {simd::InstructionSet::avx2, simd::InstructionSet::avx512}) {
      if (!simd::available(set, simd::best())) continue;
      const Output fast = run(PADE_DISPATCH(depth_row, set), k, row, with_sigma);
      EXPECT_EQ(fast.state, slow.state);
      EXPECT_TRUE(same_bits(fast.depth, slow.depth));
      EXPECT_TRUE(same_bits(fast.variance, slow.variance));
      EXPECT_TRUE(same_bits(fast.own_variance, slow.own_variance));
      EXPECT_TRUE(same_bits(fast.bound, slow.bound));
    }
    for (std::size_t i = 0; i < kCount; ++i) {
      const Twin exact = twin(k, row, i, with_sigma);
      if (std::isnan(slow.bound[i]) != std::isnan(exact.bound)) {
        ++on_the_brink;  // single precision may fall on the other side of a limit
      } else if (!std::isnan(exact.bound)) {
        EXPECT_NEAR(slow.bound[i], exact.bound, 1e-3 * exact.bound + 1e-4) << trial << ' ' << i;
        ++bounded;
      }
      if (slow.state[i] != 0) {
        EXPECT_TRUE(std::isnan(slow.depth[i]) && std::isnan(slow.variance[i]) &&
                    std::isnan(slow.own_variance[i]));
        continue;
      }
      EXPECT_NEAR(slow.depth[i], exact.z, 2e-5 * exact.z + 1e-6 * exact.z * exact.z) << trial << ' ' << i;
      EXPECT_GT(slow.own_variance[i], 0);
      if (k.has_pose) {
        EXPECT_GE(slow.variance[i], slow.own_variance[i]);
      } else {
        EXPECT_EQ(slow.variance[i], slow.own_variance[i]);
      }
      ++measured;
    }
    for (std::size_t i = 0; i < kCount; ++i) {
      if (row.gate[i] == 5) {
        EXPECT_EQ(slow.state[i], 5);
      }
      if (row.gate[i] == 3) {
        EXPECT_NE(slow.state[i], 0);
      }
      if (std::isnan(row.flow[2 * i])) {
        EXPECT_NE(slow.state[i], 0);
      }
      if (with_sigma && std::isinf(row.sigma[i])) {
        EXPECT_NE(slow.state[i], 0);
      }
      if (row.gate[i] != 0 || std::isnan(row.flow[2 * i]) || (with_sigma && std::isinf(row.sigma[i]))) {
        EXPECT_TRUE(std::isnan(slow.bound[i]));
      }
      if (slow.state[i] == 6) {
        EXPECT_GE(slow.bound[i], k.range);
      }
    }
  }
  EXPECT_GT(measured, 2500);
  EXPECT_GT(bounded, 5000);
  EXPECT_LT(on_the_brink, bounded / 1000);
}

TEST(DepthKernel, WhatIsLeftOfARotationIsRemovedLikeTheWholeOfIt) {
  // Flow w of the untouched pair, and the flow that is seen after the other image was turned by `removed`.
  Random random(17);
  int measured = 0;
  for (int trial = 0; trial < 12; ++trial) {
    Row row = random_row(random);
    KernelParameters exact = random_parameters(random);
    exact.derotation = KernelDerotation::exact;
    exact.has_pose = trial % 2 == 1;
    const Camera camera{0, 0, exact.fx, exact.fy, 0, 0};
    const Eigen::Matrix3d rotation = rotation_exp(0.03 * random.normal3()).toRotationMatrix();
    const Eigen::Matrix3d removed = rotation_exp(0.003 * random.normal3()).toRotationMatrix() * rotation;
    KernelParameters remaining = exact;
    remaining.derotation = KernelDerotation::remaining;
    const Eigen::Matrix3d left = rotation * removed.transpose();
    for (int i = 0; i < 9; ++i) {
      const double one = i % 4 == 0 ? 1 : 0;
      exact.turn[i] = static_cast<float>(rotation(i / 3, i % 3) - one);
      remaining.turn[i] = static_cast<float>(left(i / 3, i % 3) - one);
      remaining.view[i] = static_cast<float>(removed(i % 3, i / 3) - one);
    }
    // Flow that fits depths of 1.5 to 30 m, so that much is measured.
    Row turned_row = row;
    for (std::size_t i = 0; i < kCount; ++i) {
      const Eigen::Vector2d p(row.x[i], row.y);
      const Eigen::Vector3d t(exact.fx_tx / exact.fx, exact.fy_ty / exact.fy, exact.tz);
      const double z = random.uniform(1.5, 30);
      const Eigen::Vector3d point =
          rotation.transpose() * (z * Eigen::Vector3d(p.x() / camera.fx, p.y() / camera.fy, 1) - t);
      const Eigen::Vector2d match(camera.fx * point.x() / point.z(), camera.fy * point.y() / point.z());
      const Eigen::Vector3d direction = removed * point;
      const Eigen::Vector2d seen(camera.fx * direction.x() / direction.z(),
                                 camera.fy * direction.y() / direction.z());
      for (int c = 0; c < 2; ++c) {
        row.flow[2 * i + static_cast<std::size_t>(c)] = static_cast<float>(match[c] - p[c]);
        turned_row.flow[2 * i + static_cast<std::size_t>(c)] = static_cast<float>(seen[c] - p[c]);
      }
    }
    const Output a = run(&baseline::depth_row, exact, row, false);
    const Output b = run(&baseline::depth_row, remaining, turned_row, false);
    int differ = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
      differ += a.state[i] != b.state[i] ? 1 : 0;
      if (a.state[i] != b.state[i]) continue;
      if (!std::isnan(a.bound[i]) && !std::isnan(b.bound[i])) {
        EXPECT_NEAR(a.bound[i], b.bound[i], 1e-2 * a.bound[i]);
      }
      if (a.state[i] != 0) continue;
      ++measured;
      EXPECT_NEAR(a.depth[i], b.depth[i], 1e-4 * a.depth[i] * a.depth[i] + 1e-4) << trial << ' ' << i;
    }
    EXPECT_LT(differ, 10);
  }
  EXPECT_GT(measured, 3000);
}

TEST(DepthKernel, SumsOfFlowAndGradientsAreTheSameInEveryInstructionSet) {
  Random random(5);
  const Row row = random_row(random);
  std::vector<std::int16_t> gx(kCount);
  std::vector<std::int16_t> gy(kCount);
  for (std::size_t i = 0; i < kCount; ++i) {
    gx[i] = static_cast<std::int16_t>(random.uniform(-1020, 1020));
    gy[i] = static_cast<std::int16_t>(random.uniform(-1020, 1020));
  }
  for (const auto set :
       {simd::InstructionSet::baseline, simd::InstructionSet::avx2, simd::InstructionSet::avx512}) {
    if (!simd::available(set, simd::best())) continue;
    std::vector<float> u(kCount);
    std::vector<float> v(kCount);
    std::vector<float> n(kCount);
    PADE_DISPATCH(accumulate_flow_row, set)
    (row.flow.data(), row.gate.data(), kCount, u.data(), v.data(), n.data());
    std::vector<float> mean(2 * kCount);
    std::vector<std::uint8_t> empty(kCount);
    PADE_DISPATCH(mean_flow, set)(u.data(), v.data(), n.data(), kCount, mean.data(), empty.data());
    for (std::size_t i = 0; i < kCount; ++i) {
      EXPECT_EQ(empty[i], n[i] > 0 ? 0 : 1);
      if (n[i] > 0) {
        EXPECT_EQ(mean[2 * i], u[i]);  // here each window is one pixel
      } else {
        EXPECT_TRUE(std::isnan(mean[2 * i]) && std::isnan(mean[2 * i + 1]));
      }
    }
    for (const int window : {2, 3, 4, 8, 11}) {
      std::vector<float> sums(kCount / static_cast<std::size_t>(window) + 1);
      PADE_DISPATCH(sum_columns, set)(n.data(), kCount, window, sums.data());
      for (std::size_t c = 0; c * static_cast<std::size_t>(window) < kCount; ++c) {
        float sum = 0;  // whole numbers: exact in any order
        for (std::size_t i = c * static_cast<std::size_t>(window);
             i < std::min(kCount, (c + 1) * static_cast<std::size_t>(window)); ++i) {
          sum += n[i];
        }
        EXPECT_EQ(sums[c], sum);
      }
    }
    std::vector<std::int32_t> xx(kCount);
    std::vector<std::int32_t> xy(kCount);
    std::vector<std::int32_t> yy(kCount);
    PADE_DISPATCH(accumulate_gradients, set)(gx.data(), gy.data(), kCount, xx.data(), xy.data(), yy.data());
    for (std::size_t i = 0; i < kCount; ++i) {
      const bool use = !std::isnan(row.flow[2 * i]) && row.gate[i] == 0;
      EXPECT_EQ(u[i], use ? row.flow[2 * i] : 0);
      EXPECT_EQ(v[i], use ? row.flow[2 * i + 1] : 0);
      EXPECT_EQ(n[i], use ? 1 : 0);
      EXPECT_EQ(xx[i], gx[i] * gx[i]);
      EXPECT_EQ(xy[i], gx[i] * gy[i]);
      EXPECT_EQ(yy[i], gy[i] * gy[i]);
    }
  }
}

}  // namespace
}  // namespace pade::depth
