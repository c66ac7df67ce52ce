#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "pade/flow/kernels/multi_view_kernels.hpp"

#include "flow/kernels/twin_tools.hpp"

namespace pade::flow::testing {
namespace {

constexpr double kLargestParallax = 6.5;
constexpr double kLargestScale = 1.2;
constexpr double kNoise = 1.3;
constexpr double kEffectiveSize = 5;

/// A camera that has turned and gone forward and aside.
ViewGeometry geometry() {
  ViewGeometry g;
  const float H[9] = {1.01F, -0.02F, 1.4F, 0.015F, 0.99F, -0.7F, 2e-4F, -1e-4F, 1.002F};
  std::copy(std::begin(H), std::end(H), g.H);
  g.e[0] = 0.9F;
  g.e[1] = -0.4F;
  g.e[2] = 0.03F;
  g.largest_parallax2 = static_cast<float>(kLargestParallax * kLargestParallax);
  g.largest_scale = static_cast<float>(kLargestScale);
  return g;
}

struct Sight {
  double x, y;
  bool used;
};

Sight sight(const ViewGeometry& g, int x, int y, double d) {
  const auto row = [&](int i) {
    return static_cast<double>(g.H[3 * i]) * x + static_cast<double>(g.H[3 * i + 1]) * y +
           static_cast<double>(g.H[3 * i + 2]);
  };
  const double hz = row(2);
  const double z = hz + d * static_cast<double>(g.e[2]);
  const double at_x = (row(0) + d * static_cast<double>(g.e[0])) / z;
  const double at_y = (row(1) + d * static_cast<double>(g.e[1])) / z;
  const double parallax = std::hypot(at_x - row(0) / hz, at_y - row(1) / hz);
  return {at_x, at_y, z > hz / kLargestScale && z < hz * kLargestScale && parallax <= kLargestParallax};
}

/// What a view shows at a pixel of the reference, in double precision.
class Seen {
 public:
  Seen(const PlaneView& first, const PlaneView& second, const PlaneView& d)
      : first_(first), second_(second), d_(d) {}
  [[nodiscard]] Sight to(int x, int y) const { return sight(geometry(), x, y, at(d_, x, y)); }
  [[nodiscard]] bool seen(int x, int y) const {
    const Sight s = to(x, y);
    return s.used && inside(s.x, s.y);
  }
  [[nodiscard]] double residual(int x, int y) const {
    clamp(x, y);
    const Sight s = to(x, y);
    return seen(x, y) ? bilinear(second_, s.x, s.y) - at(first_, x, y) : 0;
  }
  [[nodiscard]] double mean(int x, int y) const {
    clamp(x, y);
    return at(first_, x, y) + 0.5 * residual(x, y);
  }
  /// dp'/dd by differences.
  [[nodiscard]] double slope(int x, int y, bool of_x) const {
    constexpr double kStep = 1e-4;
    const double here = at(d_, x, y);
    const Sight ahead = sight(geometry(), x, y, here + kStep);
    const Sight back = sight(geometry(), x, y, here - kStep);
    if (!seen(x, y)) return 0;
    return (of_x ? ahead.x - back.x : ahead.y - back.y) / (2 * kStep);
  }
  [[nodiscard]] const PlaneView& first() const { return first_; }
  [[nodiscard]] double distance(int x, int y) const { return at(d_, x, y); }

 private:
  static void clamp(int& x, int& y) {
    x = std::clamp(x, 0, kWidth - 1);
    y = std::clamp(y, 0, kHeight - 1);
  }
  PlaneView first_, second_, d_;
};

void tensor_twins(Twins& twins, simd::InstructionSet set, Images& m, const PlaneView& d) {
  const ViewGeometry g = geometry();
  constexpr double kGamma = 3;
  constexpr double kEpsilon2 = 2;
  ViewTensor t;
  t.first = m.first.view();
  t.second = m.second.view();
  t.distance = d;
  t.sum11 = m.out.view();
  t.sum13 = m.other.view();
  t.taps = m.k.data();
  t.radius = kRadius;
  t.gamma = static_cast<float>(kGamma);
  t.epsilon2 = static_cast<float>(kEpsilon2);
  const Strip strip = [&](int a, int b) {
    PADE_DISPATCH(view_tensor, set)(g, t, true, a, b, m.scratch.data());
    PADE_DISPATCH(view_tensor, set)(g, t, false, a, b, m.scratch.data());
  };
  const Seen see(t.first, t.second, d);
  struct Products {
    double j11, j13, j33;
  };
  const auto products = [&](int x, int y) {
    const auto mean = [&](int i, int j) { return see.mean(x + i, y + j); };
    const auto r = [&](int i, int j) { return see.residual(x + i, y + j); };
    const double ex = see.slope(x, y, true);
    const double ey = see.slope(x, y, false);
    const double gx = (8 * (mean(1, 0) - mean(-1, 0)) - (mean(2, 0) - mean(-2, 0))) / 12;
    const double gy = (8 * (mean(0, 1) - mean(0, -1)) - (mean(0, 2) - mean(0, -2))) / 12;
    const double gxx = mean(1, 0) - 2 * mean(0, 0) + mean(-1, 0);
    const double gyy = mean(0, 1) - 2 * mean(0, 0) + mean(0, -1);
    const double gxy = 0.25 * (mean(1, 1) - mean(-1, 1) - mean(1, -1) + mean(-1, -1));
    const double a = gx * ex + gy * ey;
    const double ax = gxx * ex + gxy * ey;
    const double ay = gxy * ex + gyy * ey;
    const double rx = 0.5 * (r(1, 0) - r(-1, 0));
    const double ry = 0.5 * (r(0, 1) - r(0, -1));
    return Products{a * a + kGamma * (ax * ax + ay * ay), a * r(0, 0) + kGamma * (ax * rx + ay * ry),
                    r(0, 0) * r(0, 0) + kGamma * (rx * rx + ry * ry)};
  };
  const auto sum = [&](int x, int y, double Products::*which) {
    const double j33 = window([&](int i, int j) { return products(i, j).j33; }, x, y);
    return 2 / std::sqrt(j33 + kEpsilon2) * window([&](int i, int j) { return products(i, j).*which; }, x, y);
  };
  twins.compare("view_tensor 11", m.out.view(), strip,
                [&](int x, int y) { return sum(x, y, &Products::j11); });
  twins.compare("view_tensor 13", m.other.view(), strip,
                [&](int x, int y) { return sum(x, y, &Products::j13); });
}

void cost_twins(Twins& twins, simd::InstructionSet set, Images& m, const PlaneView& d) {
  const ViewGeometry g = geometry();
  // Rivals that differ a little here, and much there.
  const Plane near = filled(kWidth, kHeight, [&](int x, int y) { return at(d, x, y) + 0.02 * x; });
  const Plane far = filled(kWidth, kHeight, [&](int x, int y) { return at(d, x, y) - (y > 20 ? 1.5 : 0.1); });
  std::vector<Plane> planes;
  for (int i = 0; i < 2 * ViewCosts::kRivals; ++i) planes.emplace_back(kWidth, kHeight);
  ViewCosts c;
  c.first = m.first.view();
  c.second = m.second.view();
  c.same = 0.3F;
  const PlaneView distances[] = {d, near.view(), far.view()};
  for (int i = 0; i < ViewCosts::kRivals; ++i) {
    c.distance[i] = distances[i];
    c.cost[i] = planes[static_cast<std::size_t>(i)].view();
    c.count[i] = planes[static_cast<std::size_t>(i + ViewCosts::kRivals)].view();
  }
  const Strip strip = [&](int a, int b) { PADE_DISPATCH(view_costs, set)(g, c, true, a, b); };
  for (int i = 0; i < ViewCosts::kRivals; ++i) {
    const auto which = [&, i](int x, int y) {
      const bool same = std::abs(c.distance[i].row(y)[x] - d.row(y)[x]) <= c.same;
      return Seen(c.first, c.second, same ? d : c.distance[i]);
    };
    twins.compare("view_costs cost", c.cost[i], strip,
                  [&](int x, int y) { return std::min(std::abs(which(x, y).residual(x, y)), 20.0); });
    twins.compare("view_costs count", c.count[i], strip,
                  [&](int x, int y) { return which(x, y).seen(x, y) ? 1.0 : 0.0; });
  }
}

void evidence_twins(Twins& twins, simd::InstructionSet set, Images& m) {
  const ViewGeometry g = geometry();
  // The same picture seen again, with some noise, where the lines put it: most matches are right.
  const Plane near =
      filled(kWidth, kHeight, [](int x, int y) { return 0.2 + 0.01 * std::sin(0.3 * x + 0.2 * y); });
  const Plane second = filled(kWidth, kHeight, [&](int x, int y) {
    const Sight s = sight(g, x, y, 0.2);
    return bilinear(m.first.view(), 2 * x - s.x, 2 * y - s.y) + 1.5 * std::sin(1.7 * x + 2.3 * y);
  });
  std::vector<Plane> planes;
  for (int i = 0; i < 7; ++i) planes.emplace_back(kWidth, kHeight);
  ViewEvidence e;
  e.first = m.first.view();
  e.second = second.view();
  e.distance = near.view();
  PlaneView* const outputs[] = {&e.information, &e.step,    &e.step2, &e.offset,
                                &e.matching,    &e.texture, &e.left};
  for (std::size_t i = 0; i < planes.size(); ++i) *outputs[i] = planes[i].view();
  e.taps = m.k.data();
  e.radius = kRadius;
  e.noise = static_cast<float>(kNoise);
  e.effective_size = static_cast<float>(kEffectiveSize);
  const Strip strip = [&](int a, int b) {
    PADE_DISPATCH(view_evidence, set)(g, e, true, a, b, m.scratch.data());
  };
  const Seen see(e.first, e.second, e.distance);
  const auto a = [&](int x, int y) {
    return gradient_x(e.first, x, y) * see.slope(x, y, true) +
           gradient_y(e.first, x, y) * see.slope(x, y, false);
  };
  const auto along = [&](int x, int y) {
    return 0.5 * ((see.residual(x + 1, y) - see.residual(x - 1, y)) * see.slope(x, y, true) +
                  (see.residual(x, y + 1) - see.residual(x, y - 1)) * see.slope(x, y, false));
  };
  struct Verdict {
    double information, step, offset, matching, texture, left;
  };
  const auto judge = [&](int x, int y) {
    const double aa = window([&](int i, int j) { return a(i, j) * a(i, j); }, x, y);
    const double ar = window([&](int i, int j) { return a(i, j) * see.residual(i, j); }, x, y);
    const double aad = window([&](int i, int j) { return a(i, j) * a(i, j) * see.distance(i, j); }, x, y);
    const double r = window([&](int i, int j) { return see.residual(i, j); }, x, y);
    const double rr = window([&](int i, int j) { return std::pow(see.residual(i, j), 2); }, x, y);
    const double left = window([&](int i, int j) { return std::pow(along(i, j), 2); }, x, y);
    const Sight s = see.to(x, y);
    const double ex = see.slope(x, y, true);
    const double ey = see.slope(x, y, false);
    const double ee = ex * ex + ey * ey;
    const double noise2 = kNoise * kNoise * ee;
    const double limit = 0.1 + 0.5 / (1 + std::hypot(s.x - x, s.y - y));
    const bool good = see.seen(x, y) && !(left - noise2 > limit * (2 * aa + noise2));
    const double variance = std::max(rr - r * r, kNoise * kNoise);
    const bool texture = good && aa > 1.5 * std::max(left, 0.09 * ee);
    return Verdict{texture ? kEffectiveSize * aa / variance : 0,
                   aa > 0 ? -ar / aa : 0,
                   aa > 0 ? aad / aa - see.distance(x, y) : 0,
                   good ? 1.0 : 0.0,
                   good ? aa / ee : 0,
                   good ? left / ee : 0};
  };
  twins.compare("view_evidence information", e.information, strip,
                [&](int x, int y) { return judge(x, y).information; });
  twins.compare("view_evidence step", e.step, strip,
                [&](int x, int y) { return judge(x, y).information * judge(x, y).step; });
  twins.compare("view_evidence step2", e.step2, strip,
                [&](int x, int y) { return judge(x, y).information * std::pow(judge(x, y).step, 2); });
  twins.compare("view_evidence offset", e.offset, strip,
                [&](int x, int y) { return judge(x, y).information * judge(x, y).offset; });
  twins.compare("view_evidence matching", e.matching, strip,
                [&](int x, int y) { return judge(x, y).matching; });
  twins.compare("view_evidence texture", e.texture, strip, [&](int x, int y) { return judge(x, y).texture; });
  twins.compare("view_evidence left", e.left, strip, [&](int x, int y) { return judge(x, y).left; });
}

}  // namespace

void multi_view_twins(Twins& twins, simd::InstructionSet set, Images& m) {
  // Distances of which some have too much parallax, and some come too near.
  const Plane d =
      filled(kWidth, kHeight, [](int x, int y) { return 4.5 + 4.3 * std::sin(0.06 * x + 0.09 * y); });
  tensor_twins(twins, set, m, d.view());
  cost_twins(twins, set, m, d.view());
  evidence_twins(twins, set, m);
}

}  // namespace pade::flow::testing
