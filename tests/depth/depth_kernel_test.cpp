#include "pade/depth/depth_kernel.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <vector>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"

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
  for (const int diagonal : {0, 6, 11, 15, 18, 20})
    k.pose[diagonal] = static_cast<float>(1e-6 * random.uniform());
  return k;
}

/// The kernel's arithmetic in a few lines of double precision: the slow twin. NaN = no depth.
double twin_depth(const KernelParameters& k, const Row& row, std::size_t i) {
  const double x = row.x[i];
  const double y = row.y;
  const double w[2] = {row.flow[2 * i], row.flow[2 * i + 1]};
  double d[2] = {w[0], w[1]};
  if (k.derotation == KernelDerotation::exact) {
    const double ray[3] = {(x + w[0]) / k.fx, (y + w[1]) / k.fy, 1};
    double b[3];
    for (int r = 0; r < 3; ++r) {
      b[r] = ray[r] + k.turn[3 * r] * ray[0] + k.turn[3 * r + 1] * ray[1] + k.turn[3 * r + 2] * ray[2];
    }
    d[0] = k.fx * b[0] / b[2] - x;
    d[1] = k.fy * b[1] / b[2] - y;
  } else if (k.derotation == KernelDerotation::first_order) {
    const double u = x / k.fx;
    const double v = y / k.fy;
    d[0] += k.fx * (-u * v * k.omega[0] + (1 + u * u) * k.omega[1] - v * k.omega[2]);
    d[1] += k.fy * (-(1 + v * v) * k.omega[0] + u * v * k.omega[1] + u * k.omega[2]);
  }
  const double a[2] = {x * k.tz - k.fx_tx, y * k.tz - k.fy_ty};
  const double aa = a[0] * a[0] + a[1] * a[1];
  const double ad = a[0] * d[0] + a[1] * d[1];
  return (k.samelson ? ad / (d[0] * d[0] + d[1] * d[1]) : aa / ad) + k.add_tz;
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

TEST(DepthKernel, EveryInstructionSetGivesTheSameBitsAndAgreesWithItsSlowTwin) {
  Random random(3);
  int measured = 0;
  for (int trial = 0; trial < 48; ++trial) {
    const Row row = random_row(random);
    KernelParameters k = random_parameters(random);
    k.derotation = static_cast<KernelDerotation>(trial % 3);
    k.samelson = (trial / 3) % 2 == 1;
    k.has_pose = (trial / 6) % 2 == 1;
    const bool with_sigma = (trial / 12) % 2 == 1;
    const Output slow = run(&baseline::depth_row, k, row, with_sigma);
    for (const auto set : {simd::InstructionSet::avx2, simd::InstructionSet::avx512}) {
      if (!simd::available(set, simd::best())) continue;
      const Output fast = run(PADE_DISPATCH(depth_row, set), k, row, with_sigma);
      EXPECT_EQ(fast.state, slow.state);
      EXPECT_EQ(std::memcmp(fast.depth.data(), slow.depth.data(), kCount * sizeof(float)), 0);
      EXPECT_EQ(std::memcmp(fast.variance.data(), slow.variance.data(), kCount * sizeof(float)), 0);
    }
    for (std::size_t i = 0; i < kCount; ++i) {
      if (slow.state[i] != 0) {
        EXPECT_TRUE(std::isnan(slow.depth[i]) && std::isnan(slow.variance[i]));
        continue;
      }
      const double z = twin_depth(k, row, i);
      EXPECT_NEAR(slow.depth[i], z, 2e-5 * z + 1e-6 * z * z) << trial << ' ' << i;
      EXPECT_GT(slow.variance[i], 0);
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
    }
  }
  EXPECT_GT(measured, 2500);
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
