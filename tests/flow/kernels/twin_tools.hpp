// What the scalar twins of all kernels share: random images, slow but plain arithmetic on them, and the
// comparison with a kernel.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "pade/core/compute/simd.hpp"
#include "pade/flow/pyramid/plane.hpp"

#include "flow/kernels/kernel_twins.hpp"

namespace pade::flow::testing {

inline constexpr int kWidth = 77;  // no multiple of any vector
inline constexpr int kHeight = 43;
inline constexpr int kRadius = 3;

inline double at(const PlaneView& plane, int x, int y) {
  return plane.row(std::clamp(y, 0, plane.height - 1))[std::clamp(x, 0, plane.width - 1)];
}

using Value = std::function<double(int x, int y)>;

inline Plane filled(int width, int height, const Value& value) {
  Plane plane(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < plane.stride() && x < padded(width); ++x) {
      plane.row(y)[x] = static_cast<float>(value(std::min(x, width - 1), y));
    }
  }
  return plane;
}

// A smooth picture with noise; and a flow that partly leaves the image.
inline Plane picture(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-10, 10);
  return filled(kWidth, kHeight, [&](int x, int y) {
    return 120 + 60 * std::sin(0.21 * x + 0.1 * y + seed) + 40 * std::cos(0.33 * y - 0.05 * x * seed) +
           noise(random);
  });
}
inline Plane flow_component(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-0.3, 0.3);
  return filled(kWidth, kHeight,
                [&](int x, int y) { return 4 * std::sin(0.05 * x + 0.08 * y + seed) + noise(random); });
}

inline std::vector<float> taps() {
  std::vector<float> k;
  double sum = 0;
  for (int i = 0; i <= kRadius; ++i) sum += (i == 0 ? 1 : 2) * std::exp(-0.5 * i * i / 2.25);
  for (int i = 0; i <= kRadius; ++i) k.push_back(static_cast<float>(std::exp(-0.5 * i * i / 2.25) / sum));
  return k;
}

// Windowed sum with zeros outside the image.
inline double window(const Value& value, int x, int y) {
  static const std::vector<float> k = taps();
  double sum = 0;
  for (int j = -kRadius; j <= kRadius; ++j) {
    for (int i = -kRadius; i <= kRadius; ++i) {
      if (x + i < 0 || y + j < 0 || x + i >= kWidth || y + j >= kHeight) continue;
      sum += static_cast<double>(k[static_cast<std::size_t>(std::abs(i))]) *
             static_cast<double>(k[static_cast<std::size_t>(std::abs(j))]) * value(x + i, y + j);
    }
  }
  return sum;
}

inline double gradient_x(const PlaneView& p, int x, int y) {
  return (8 * (at(p, x + 1, y) - at(p, x - 1, y)) - (at(p, x + 2, y) - at(p, x - 2, y))) / 12;
}
inline double gradient_y(const PlaneView& p, int x, int y) {
  return (8 * (at(p, x, y + 1) - at(p, x, y - 1)) - (at(p, x, y + 2) - at(p, x, y - 2))) / 12;
}
inline bool inside(double x, double y) { return x >= 0 && y >= 0 && x <= kWidth - 1 && y <= kHeight - 1; }
inline double bilinear(const PlaneView& p, double x, double y) {
  x = std::clamp(x, 0.0, kWidth - 1.0);
  y = std::clamp(y, 0.0, kHeight - 1.0);
  const int ix = static_cast<int>(x);
  const int iy = static_cast<int>(y);
  const double ax = x - ix;
  const double ay = y - iy;
  return (1 - ay) * ((1 - ax) * at(p, ix, iy) + ax * at(p, ix + 1, iy)) +
         ay * ((1 - ax) * at(p, ix, iy + 1) + ax * at(p, ix + 1, iy + 1));
}

using Strip = std::function<void(int first, int last)>;

class Twins {
 public:
  // Runs `kernel` in one go and in three strips, and compares `output` with `twin`.
  void compare(const std::string& name, const PlaneView& output, const Strip& kernel, const Value& twin) {
    kernel(0, output.height);
    TwinResult result{name, 0, true, copy(output)};
    double largest = 1e-3;
    for (int y = 0; y < output.height; ++y) {
      for (int x = 0; x < output.width; ++x) {
        const double expected = twin(x, y);
        const double found = output.row(y)[x];
        if (std::isinf(expected) && std::isinf(found)) continue;
        largest = std::max(largest, std::abs(expected));
        result.largest_difference = std::max(result.largest_difference, std::abs(found - expected));
        if (std::isnan(found)) result.largest_difference = std::numeric_limits<double>::infinity();
      }
    }
    result.largest_difference /= largest;
    for (int y = 0; y < output.height; ++y) std::fill_n(output.row(y), output.width, -1e9F);
    const int cuts[] = {0, output.height / 5, output.height / 2, output.height};
    for (const int i : {2, 0, 1}) kernel(cuts[i], cuts[i + 1]);
    const std::vector<float> again = copy(output);
    result.strips_agree = std::memcmp(again.data(), result.values.data(), again.size() * sizeof(float)) == 0;
    results.push_back(std::move(result));
  }

  std::vector<TwinResult> results;

 private:
  static std::vector<float> copy(const PlaneView& plane) {
    std::vector<float> values;
    for (int y = 0; y < plane.height; ++y)
      values.insert(values.end(), plane.row(y), plane.row(y) + plane.width);
    return values;
  }
};

struct Images {
  Plane first = picture(1), second = picture(2), u = flow_component(3), v = flow_component(4),
        out{kWidth, kHeight}, other{kWidth, kHeight};
  std::vector<float> k = taps();
  std::vector<float> scratch = std::vector<float>(200000, 0.0F);
};

void clg_twins(Twins& twins, simd::InstructionSet set, Images& m);
void epipolar_twins(Twins& twins, simd::InstructionSet set, Images& m);
void multi_view_twins(Twins& twins, simd::InstructionSet set, Images& m);

}  // namespace pade::flow::testing
