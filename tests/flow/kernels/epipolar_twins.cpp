#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "pade/flow/kernels/epipolar_kernels.hpp"
#include "pade/flow/pyramid/split_plane.hpp"

#include "flow/kernels/twin_tools.hpp"

namespace pade::flow::testing {
namespace {

constexpr double kDamping = 0.7;
constexpr double kLargestStep = 1.5;
constexpr double kAlpha = 5;
constexpr double kGamma = 2;
constexpr double kSmoothEpsilon2 = 0.01;

// Lines that turn from pixel to pixel, and are undefined in a few places.
struct Lines {
  Plane base_u = flow_component(5);
  Plane base_v = flow_component(6);
  Plane x = filled(kWidth, kHeight, [](int i, int j) { return defined(i, j) * std::cos(angle(i, j)); });
  Plane y = filled(kWidth, kHeight, [](int i, int j) { return defined(i, j) * std::sin(angle(i, j)); });

  [[nodiscard]] EpipolarLevel view() const { return {base_u.view(), base_v.view(), x.view(), y.view()}; }

 private:
  static double angle(int i, int j) { return 0.07 * i - 0.11 * j; }
  static double defined(int i, int j) { return i > 30 && i < 34 && j > 20 && j < 24 ? 0 : 1; }
};

struct Point {
  double x, y;
};

// Where a line puts pixel (x, y) at distance d.
Point target(const EpipolarLevel& e, int x, int y, double d) {
  return {x + at(e.base_u, x, y) + d * at(e.direction_x, x, y),
          y + at(e.base_v, x, y) + d * at(e.direction_y, x, y)};
}

double along(const EpipolarLevel& e, int x, int y, double value_x, double value_y) {
  return value_x * at(e.direction_x, x, y) + value_y * at(e.direction_y, x, y);
}

void line_twins(Twins& twins, simd::InstructionSet set, Images& m, const Lines& lines) {
  const EpipolarLevel e = lines.view();
  const PlaneView d = m.u.view();
  const Strip flow = [&](int a, int b) {
    PADE_DISPATCH(epipolar_flow, set)(e, d, m.out.view(), m.other.view(), a, b);
  };
  twins.compare("epipolar_flow u", m.out.view(), flow,
                [&](int x, int y) { return target(e, x, y, at(d, x, y)).x - x; });
  twins.compare("epipolar_flow v", m.other.view(), flow,
                [&](int x, int y) { return target(e, x, y, at(d, x, y)).y - y; });
  std::vector<float> pairs(2 * kWidth);
  const auto value = [](int x, int y, int c) {
    if ((x + y) % 13 == 5 && c == x % 2) return std::numeric_limits<float>::quiet_NaN();
    if ((x + y) % 17 == 3 && c == 0) return -std::numeric_limits<float>::infinity();
    return static_cast<float>(x - 2 * y + 100 * c);
  };
  const Strip split = [&](int a, int b) {
    for (int y = a; y < b; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        for (int c = 0; c < 2; ++c) pairs[static_cast<std::size_t>(2 * x + c)] = value(x, y, c);
      }
      PADE_DISPATCH(split_components, set)(pairs.data(), m.out.view().row(y), m.other.view().row(y), kWidth);
    }
  };
  for (const int c : {0, 1}) {
    twins.compare(c == 0 ? "split_components x" : "split_components y",
                  c == 0 ? m.out.view() : m.other.view(), split, [&](int x, int y) {
                    const bool known = std::isfinite(value(x, y, 0)) && std::isfinite(value(x, y, 1));
                    return known ? static_cast<double>(value(x, y, c)) : 0.0;
                  });
  }
  Plane half((kWidth + 1) / 2, (kHeight + 1) / 2);
  twins.compare(
      "every_other", half.view(),
      [&](int a, int b) {
        PADE_DISPATCH(every_other, set)
        (d, half.view(), 0.5F, a, b);
      },
      [&](int x, int y) { return 0.5 * at(d, 2 * x, 2 * y); });
}

void lucas_kanade_line_twins(Twins& twins, simd::InstructionSet set, Images& m, const Lines& lines) {
  Plane slope(kWidth, kHeight), inverse(kWidth, kHeight);
  EpipolarLucasKanade level;
  level.line = lines.view();
  level.first = m.first.view();
  level.second = m.second.view();
  level.slope = slope.view();
  level.inverse = inverse.view();
  level.distance = m.u.view();
  level.next_distance = m.out.view();
  level.taps = m.k.data();
  level.radius = kRadius;
  level.damping = static_cast<float>(kDamping);
  level.largest_step = static_cast<float>(kLargestStep);
  const auto a = [&](int x, int y) {
    return along(level.line, x, y, gradient_x(level.first, x, y), gradient_y(level.first, x, y));
  };
  const auto weight = [&](int x, int y) {
    return window([&](int i, int j) { return a(i, j) * a(i, j); }, x, y) + kDamping;
  };
  twins.compare(
      "epipolar_lk_slope", level.slope,
      [&](int from, int to) {
        PADE_DISPATCH(epipolar_lk_slope, set)
        (level, from, to, m.scratch.data());
      },
      a);
  twins.compare(
      "epipolar_lk_prepare", level.inverse,
      [&](int from, int to) {
        PADE_DISPATCH(epipolar_lk_prepare, set)
        (level, from, to, m.scratch.data());
      },
      [&](int x, int y) { return 1 / weight(x, y); });
  twins.compare(
      "epipolar_lk_iterate", level.next_distance,
      [&](int from, int to) {
        PADE_DISPATCH(epipolar_lk_iterate, set)
        (level, from, to, m.scratch.data());
      },
      [&](int x, int y) {
        const double side = window(
            [&](int i, int j) {
              const double d = at(level.distance, i, j);
              const Point to = target(level.line, i, j, d);
              const double residual =
                  inside(to.x, to.y) ? bilinear(level.second, to.x, to.y) - at(level.first, i, j) : 0;
              return a(i, j) * (a(i, j) * d - residual);
            },
            x, y);
        const double d = at(level.distance, x, y);
        return d + std::clamp((side + kDamping * d) / weight(x, y) - d, -kLargestStep, kLargestStep);
      });
}

struct ClgScene {
  Plane mean{kWidth, kHeight}, difference{kWidth, kHeight}, distance0{kWidth, kHeight}, j11{kWidth, kHeight},
      j13{kWidth, kHeight}, j33{kWidth, kHeight};
  SplitPlane split[5];
  EpipolarClg level;

  ClgScene(Images& m, const Lines& lines) {
    for (SplitPlane& plane : split) plane.resize(kWidth, kHeight);
    level.line = lines.view();
    level.first = m.first.view();
    level.second = m.second.view();
    level.mean = mean.view();
    level.difference = difference.view();
    level.distance0 = distance0.view();
    level.distance = m.u.view();
    level.j11 = j11.view();
    level.j13 = j13.view();
    level.j33 = j33.view();
    level.split_distance = split[0].view();
    level.inverse = split[1].view();
    level.right_hand_side = split[2].view();
    level.right = split[3].view();
    level.below = split[4].view();
    level.taps = m.k.data();
    level.radius = kRadius;
    level.alpha = static_cast<float>(kAlpha);
    level.gamma = static_cast<float>(kGamma);
    level.data_epsilon2 = 1;
    level.smooth_epsilon2 = static_cast<float>(kSmoothEpsilon2);
  }
  [[nodiscard]] Point to(int x, int y) const { return target(level.line, x, y, at(level.distance, x, y)); }
};

void warp_and_tensor_twins(Twins& twins, simd::InstructionSet set, Images& m, ClgScene& scene) {
  const EpipolarClg& level = scene.level;
  const Strip warp = [&](int a, int b) { PADE_DISPATCH(epipolar_clg_warp, set)(level, a, b); };
  const auto seen = [&](int x, int y) { return inside(scene.to(x, y).x, scene.to(x, y).y); };
  const auto warped = [&](int x, int y) {
    return bilinear(level.second, scene.to(x, y).x, scene.to(x, y).y);
  };
  twins.compare("epipolar_clg_warp difference", level.difference, warp,
                [&](int x, int y) { return seen(x, y) ? warped(x, y) - at(level.first, x, y) : 0; });
  twins.compare("epipolar_clg_warp mean", level.mean, warp, [&](int x, int y) {
    return seen(x, y) ? 0.5 * (warped(x, y) + at(level.first, x, y)) : at(level.first, x, y);
  });
  const Strip tensor = [&](int a, int b) {
    PADE_DISPATCH(epipolar_clg_tensor, set)(level, a, b, m.scratch.data());
  };
  // The products of the slope a, its derivatives and those of the difference.
  struct Slopes {
    double a, ax, ay, t, tx, ty;
  };
  const auto slopes = [&](int x, int y) {
    const PlaneView& p = level.mean;
    const PlaneView& d = level.difference;
    const double xx = at(p, x + 1, y) - 2 * at(p, x, y) + at(p, x - 1, y);
    const double yy = at(p, x, y + 1) - 2 * at(p, x, y) + at(p, x, y - 1);
    const double xy =
        (at(p, x + 1, y + 1) - at(p, x - 1, y + 1) - at(p, x + 1, y - 1) + at(p, x - 1, y - 1)) / 4;
    return Slopes{along(level.line, x, y, gradient_x(p, x, y), gradient_y(p, x, y)),
                  along(level.line, x, y, xx, xy),
                  along(level.line, x, y, xy, yy),
                  at(d, x, y),
                  (at(d, x + 1, y) - at(d, x - 1, y)) / 2,
                  (at(d, x, y + 1) - at(d, x, y - 1)) / 2};
  };
  twins.compare("epipolar_clg_tensor j11", level.j11, tensor, [&](int x, int y) {
    return window(
        [&](int i, int j) {
          const Slopes s = slopes(i, j);
          return seen(i, j) ? s.a * s.a + kGamma * (s.ax * s.ax + s.ay * s.ay) : 0;
        },
        x, y);
  });
  twins.compare("epipolar_clg_tensor j13", level.j13, tensor, [&](int x, int y) {
    return window(
        [&](int i, int j) {
          const Slopes s = slopes(i, j);
          return seen(i, j) ? s.a * s.t + kGamma * (s.ax * s.tx + s.ay * s.ty) : 0;
        },
        x, y);
  });
}

// Smoothness weight between a pixel and its right or lower neighbour.
double link(const PlaneView& d, int x, int y, int dx, int dy) {
  if (x < 0 || y < 0 || x + dx >= kWidth || y + dy >= kHeight) return 0;
  const double step = at(d, x + dx, y + dy) - at(d, x, y);
  const double across = (at(d, x + dy, y + dx) - at(d, x - dy, y - dx) + at(d, x + dx + dy, y + dy + dx) -
                         at(d, x + dx - dy, y + dy - dx)) /
                        4;
  return kAlpha / std::sqrt(step * step + across * across + kSmoothEpsilon2);
}

// As for the general form: the twin visits the checkerboard in the textbook order.
void system_twin(Twins& twins, simd::InstructionSet set, Images& m, ClgScene& scene) {
  const EpipolarClg& level = scene.level;
  // The second lagged step, whose distance is no longer the one of the warp.
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) level.distance0.row(y)[x] -= static_cast<float>(0.1 * std::sin(x + y));
  }
  constexpr double kOmega = 1.5;
  constexpr int kSweeps = 3;
  std::vector<double> d(kWidth * kHeight);
  const auto index = [](int x, int y) { return static_cast<std::size_t>(y * kWidth + x); };
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) d[index(x, y)] = at(level.distance, x, y);
  }
  for (int half = 0; half < 2 * kSweeps; ++half) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = (y + half) % 2; x < kWidth; x += 2) {
        const double d0 = at(level.distance0, x, y);
        const double step = at(level.distance, x, y) - d0;
        const double j11 = at(level.j11, x, y);
        const double j13 = at(level.j13, x, y);
        const double residual = at(level.j33, x, y) + j11 * step * step + 2 * j13 * step;
        const double psi = 1 / std::sqrt(std::max(residual, 0.0) + 1);
        double links = 0;
        double side = psi * (j11 * d0 - j13);
        const int neighbours[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
        for (const auto& n : neighbours) {
          const double w = link(level.distance, std::min(x, x + n[0]), std::min(y, y + n[1]), std::abs(n[0]),
                                std::abs(n[1]));
          if (w == 0) continue;
          links += w;
          side += w * d[index(x + n[0], y + n[1])];
        }
        d[index(x, y)] += kOmega * (side / (psi * j11 + links) - d[index(x, y)]);
      }
    }
  }
  twins.compare(
      "epipolar_clg_system, _relax", m.out.view(),
      [&](int first, int last) {
        if (last != kHeight) return;  // the sweeps need the whole system: built in one go, or in two strips
        const int cut = first == 0 ? kHeight : kHeight / 3;
        PADE_DISPATCH(epipolar_clg_system, set)(level, 0, cut, m.scratch.data());
        PADE_DISPATCH(epipolar_clg_system, set)(level, cut, kHeight, m.scratch.data());
        PADE_DISPATCH(clg_split, set)(level.distance, level.split_distance, 0, kHeight);
        PADE_DISPATCH(epipolar_clg_relax, set)(level, kSweeps, static_cast<float>(kOmega));
        PADE_DISPATCH(clg_join, set)(level.split_distance, m.out.view(), 0, kHeight);
      },
      [&](int x, int y) { return d[index(x, y)]; });
}

}  // namespace

void epipolar_twins(Twins& twins, simd::InstructionSet set, Images& m) {
  const Lines lines;
  line_twins(twins, set, m, lines);
  lucas_kanade_line_twins(twins, set, m, lines);
  ClgScene scene(m, lines);
  warp_and_tensor_twins(twins, set, m, scene);
  system_twin(twins, set, m, scene);
}

}  // namespace pade::flow::testing
