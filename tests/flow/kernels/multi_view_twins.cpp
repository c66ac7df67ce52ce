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

struct LinePlanes {
  Plane base_u{kWidth, kHeight}, base_v{kWidth, kHeight}, x{kWidth, kHeight}, y{kWidth, kHeight};
  [[nodiscard]] EpipolarLevel view() const { return {base_u.view(), base_v.view(), x.view(), y.view()}; }
};

void line_twins(Twins& twins, simd::InstructionSet set, const PlaneView& d, const LinePlanes& lines) {
  const ViewGeometry g = geometry();
  const EpipolarLevel e = lines.view();
  const Strip strip = [&](int a, int b) { PADE_DISPATCH(view_lines, set)(g, d, e, a, b); };
  // dp'/dd by differences in double precision
  const auto slope = [&](int x, int y, bool of_x) {
    constexpr double kStep = 1e-4;
    const double here = at(d, x, y);
    const Sight ahead = sight(g, x, y, here + kStep);
    const Sight back = sight(g, x, y, here - kStep);
    return (of_x ? ahead.x - back.x : ahead.y - back.y) / (2 * kStep);
  };
  const auto used = [&](int x, int y, double value) { return sight(g, x, y, at(d, x, y)).used ? value : 0; };
  twins.compare("view_lines direction x", e.direction_x, strip,
                [&](int x, int y) { return used(x, y, slope(x, y, true)); });
  twins.compare("view_lines direction y", e.direction_y, strip,
                [&](int x, int y) { return used(x, y, slope(x, y, false)); });
  twins.compare("view_lines base u", e.base_u, strip, [&](int x, int y) {
    const double here = at(d, x, y);
    return used(x, y, sight(g, x, y, here).x - x - here * slope(x, y, true));
  });
  twins.compare("view_lines base v", e.base_v, strip, [&](int x, int y) {
    const double here = at(d, x, y);
    return used(x, y, sight(g, x, y, here).y - y - here * slope(x, y, false));
  });
}

void sum_twins(Twins& twins, simd::InstructionSet set, Images& m, const PlaneView& d) {
  const ViewGeometry g = geometry();
  const PlaneView first = m.first.view();
  const PlaneView second = m.second.view();
  const Strip cost = [&](int a, int b) {
    PADE_DISPATCH(view_cost, set)(g, first, second, d, m.out.view(), m.other.view(), true, a, b);
  };
  const auto seen = [&](int x, int y) {
    const Sight s = sight(g, x, y, at(d, x, y));
    return s.used && inside(s.x, s.y);
  };
  twins.compare("view_cost cost", m.out.view(), cost, [&](int x, int y) {
    const Sight s = sight(g, x, y, at(d, x, y));
    return seen(x, y) ? std::min(std::abs(bilinear(second, s.x, s.y) - at(first, x, y)), 20.0) : 0.0;
  });
  twins.compare("view_cost count", m.other.view(), cost,
                [&](int x, int y) { return seen(x, y) ? 1.0 : 0.0; });

  Plane j33 = filled(kWidth, kHeight, [](int x, int y) { return 3.0 + std::sin(0.3 * x + 0.2 * y); });
  ViewTensor tensor{first, second, j33.view(), m.out.view(), m.other.view(), 2};
  const Strip add = [&](int a, int b) {
    PADE_DISPATCH(view_add, set)(tensor, true, a, b);
    PADE_DISPATCH(view_add, set)(tensor, false, a, b);
  };
  const auto weight = [&](int x, int y) { return 2 / std::sqrt(at(j33.view(), x, y) + 2); };
  twins.compare("view_add 11", m.out.view(), add,
                [&](int x, int y) { return weight(x, y) * at(first, x, y); });
  twins.compare("view_add 13", m.other.view(), add,
                [&](int x, int y) { return weight(x, y) * at(second, x, y); });
}

void evidence_twins(Twins& twins, simd::InstructionSet set, Images& m, const PlaneView& d,
                    const LinePlanes& lines) {
  PADE_DISPATCH(view_lines, set)(geometry(), d, lines.view(), 0, kHeight);
  // The same picture seen again, with some noise: most matches are right.
  const Plane second = filled(kWidth, kHeight, [&](int x, int y) {
    return at(m.first.view(), x, y) + 1.5 * std::sin(1.7 * x + 2.3 * y);
  });
  Plane near = filled(kWidth, kHeight, [](int, int) { return 0.2; });
  Plane information(kWidth, kHeight), step(kWidth, kHeight), step2(kWidth, kHeight),
      matching(kWidth, kHeight), wrong(kWidth, kHeight);
  ViewEvidence e;
  e.line = lines.view();
  e.first = m.first.view();
  e.second = second.view();
  e.distance = near.view();
  e.information = information.view();
  e.step = step.view();
  e.step2 = step2.view();
  e.matching = matching.view();
  e.wrong = wrong.view();
  e.taps = m.k.data();
  e.radius = kRadius;
  e.noise = static_cast<float>(kNoise);
  e.image_noise = 0.3F;
  e.effective_size = static_cast<float>(kEffectiveSize);
  const Strip strip = [&](int a, int b) {
    PADE_DISPATCH(view_evidence, set)(e, true, a, b, m.scratch.data());
  };
  const auto to = [&](int x, int y) {
    const double here = at(e.distance, x, y);
    return Sight{x + at(e.line.base_u, x, y) + here * at(e.line.direction_x, x, y),
                 y + at(e.line.base_v, x, y) + here * at(e.line.direction_y, x, y), true};
  };
  const auto residual = [&](int x, int y) {
    x = std::clamp(x, 0, kWidth - 1);
    y = std::clamp(y, 0, kHeight - 1);
    const Sight s = to(x, y);
    return bilinear(e.second, s.x, s.y) - at(e.first, x, y);
  };
  const auto a = [&](int x, int y) {
    return gradient_x(e.first, x, y) * at(e.line.direction_x, x, y) +
           gradient_y(e.first, x, y) * at(e.line.direction_y, x, y);
  };
  struct Verdict {
    double information, step;
    bool matching, wrong;
  };
  const auto judge = [&](int x, int y) {
    const double aa = window([&](int i, int j) { return a(i, j) * a(i, j); }, x, y);
    const double ar = window([&](int i, int j) { return a(i, j) * residual(i, j); }, x, y);
    const double gg = window(
        [&](int i, int j) {
          return std::pow(gradient_x(e.first, i, j), 2) + std::pow(gradient_y(e.first, i, j), 2);
        },
        x, y);
    const double r = window(residual, x, y);
    const double rr = window([&](int i, int j) { return std::pow(residual(i, j), 2); }, x, y);
    const double left = window(
        [&](int i, int j) {
          return 0.25 * (std::pow(residual(i + 1, j) - residual(i - 1, j), 2) +
                         std::pow(residual(i, j + 1) - residual(i, j - 1), 2));
        },
        x, y);
    const double ex = at(e.line.direction_x, x, y);
    const double ey = at(e.line.direction_y, x, y);
    const Sight s = to(x, y);
    const double moved = std::hypot(s.x - x, s.y - y);
    const double noise2 = 2 * kNoise * kNoise;
    const bool bad = left - noise2 > (0.1 + 0.5 / (1 + moved)) * (2 * gg + noise2);
    const bool seen = inside(s.x, s.y) && ex * ex + ey * ey > 0;
    const bool texture = aa > 1.5 * std::max(left / 2, 0.09) * (ex * ex + ey * ey);
    const double variance = std::max(rr - r * r, kNoise * kNoise);
    return Verdict{seen && !bad && texture ? kEffectiveSize * aa / variance : 0, aa > 0 ? -ar / aa : 0,
                   seen && !bad, seen && bad};
  };
  twins.compare("view_evidence information", e.information, strip,
                [&](int x, int y) { return judge(x, y).information; });
  twins.compare("view_evidence step", e.step, strip,
                [&](int x, int y) { return judge(x, y).information * judge(x, y).step; });
  twins.compare("view_evidence step2", e.step2, strip,
                [&](int x, int y) { return judge(x, y).information * std::pow(judge(x, y).step, 2); });
  twins.compare("view_evidence matching", e.matching, strip,
                [&](int x, int y) { return judge(x, y).matching ? 1.0 : 0.0; });
  twins.compare("view_evidence wrong", e.wrong, strip,
                [&](int x, int y) { return judge(x, y).wrong ? 1.0 : 0.0; });
}

}  // namespace

void multi_view_twins(Twins& twins, simd::InstructionSet set, Images& m) {
  // Distances of which some have too much parallax, and some come too near.
  const Plane d =
      filled(kWidth, kHeight, [](int x, int y) { return 4.5 + 4.3 * std::sin(0.06 * x + 0.09 * y); });
  const LinePlanes lines;
  line_twins(twins, set, d.view(), lines);
  sum_twins(twins, set, m, d.view());
  evidence_twins(twins, set, m, d.view(), lines);
}

}  // namespace pade::flow::testing
