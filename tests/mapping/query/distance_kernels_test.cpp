// The kernels of the distance field against a search of all voxels, on each instruction set that runs here.
#include "pade/mapping/query/distance_kernels.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace pade::mapping {
namespace {

/// A box at random with the bits of its rows.
struct RandomBox {
  int nx, ny, nz;
  int stride, row_bytes, first_bit;
  std::vector<std::array<int, 3>> blocked;
  std::vector<std::uint8_t> bits;

  RandomBox(std::mt19937_64& random, int longest) {
    const auto draw = [&](int from, int to) { return std::uniform_int_distribution<int>(from, to)(random); };
    nx = draw(1, longest);
    ny = draw(1, longest);
    nz = draw(1, longest / 2);
    stride = (nx + kDistanceLanes - 1) / kDistanceLanes * kDistanceLanes;
    row_bytes = stride / 8 + 16;
    first_bit = draw(0, 7);
    bits.assign(static_cast<std::size_t>(row_bytes * ny * nz), 0);
    const int count = draw(0, 3) == 0 ? draw(0, 2) : draw(0, std::min(nx * ny * nz / 20, 300));
    for (int i = 0; i < count; ++i) {
      const auto& v = blocked.emplace_back(std::array{draw(0, nx - 1), draw(0, ny - 1), draw(0, nz - 1)});
      const int bit = first_bit + v[0];
      bits[static_cast<std::size_t>((v[2] * ny + v[1]) * row_bytes + bit / 8)] |=
          static_cast<std::uint8_t>(1U << (bit & 7));
    }
    // What lies before the box in its first tile does not count.
    for (std::size_t row = 0; row < bits.size(); row += static_cast<std::size_t>(row_bytes))
      bits[row] |= static_cast<std::uint8_t>((1U << first_bit) - 1);
  }
  [[nodiscard]] std::int32_t nearest(int x, int y, int z, std::int32_t most) const {
    std::int32_t least = most;
    for (const auto& v : blocked) {
      const int dx = v[0] - x;
      const int dy = v[1] - y;
      const int dz = v[2] - z;
      least = std::min(least, dx * dx + dy * dy + dz * dz);
    }
    return least;
  }
};

template <class Value>
void expect_nearest(const RandomBox& box, std::int32_t most, void (*kernel)(const DistanceBox<Value>&)) {
  std::vector<Value> squared(static_cast<std::size_t>(box.stride * box.ny * box.nz), -1);
  std::vector<Value> scratch(
      static_cast<std::size_t>(distance_scratch(std::max({box.nx, box.ny, box.nz}), box.stride)));
  kernel({box.nx, box.ny, box.nz, box.stride, box.bits.data(), box.row_bytes, box.first_bit, most,
          squared.data(), scratch.data()});
  for (int z = 0; z < box.nz; ++z)
    for (int y = 0; y < box.ny; ++y)
      for (int x = 0; x < box.nx; ++x)
        ASSERT_EQ(squared[static_cast<std::size_t>((z * box.ny + y) * box.stride + x)],
                  box.nearest(x, y, z, most))
            << x << ' ' << y << ' ' << z << " of " << box.nx << ' ' << box.ny << ' ' << box.nz << ", most "
            << most;
}

TEST(DistanceKernels, HaveTheDistanceToTheNearestOfAllVoxels) {
  using simd::InstructionSet;
  std::mt19937_64 random(31);
  for (int i = 0; i < 40; ++i) {
    const RandomBox box(random, i % 20 == 0 ? 70 : 20);
    const std::int32_t most = std::uniform_int_distribution<int>(1, i % 3 == 0 ? 30 : 2000)(random);
    for (const auto set : {InstructionSet::baseline, InstructionSet::avx2, InstructionSet::avx512}) {
      if (!simd::available(set, simd::best())) continue;
      SCOPED_TRACE(simd::name(set));
      expect_nearest<std::int16_t>(box, most, PADE_DISPATCH(near_distances, set));
      expect_nearest<std::int16_t>(box, kMostOf16Bits, PADE_DISPATCH(near_distances, set));
      expect_nearest<std::int32_t>(box, 40 * most, PADE_DISPATCH(far_distances, set));
      if (HasFatalFailure()) return;
    }
  }
}

}  // namespace
}  // namespace pade::mapping
