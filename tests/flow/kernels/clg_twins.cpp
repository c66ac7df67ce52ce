#include <algorithm>
#include <cmath>
#include <vector>

#include "pade/flow/kernels/clg_kernels.hpp"
#include "pade/flow/pyramid/split_plane.hpp"

#include "flow/kernels/twin_tools.hpp"

namespace pade::flow::testing {

// The system and the sweeps are checked together: the twin builds the weights with plain loops and visits the
// checkerboard in the textbook order.
void clg_twins(Twins& twins, simd::InstructionSet set, Images& m) {
  Plane mean(kWidth, kHeight), difference(kWidth, kHeight), j[6], u0 = flow_component(3),
                                                                  v0 = flow_component(4);
  for (Plane& plane : j) plane.resize(kWidth, kHeight);
  SplitPlane split[9];
  for (SplitPlane& plane : split) plane.resize(kWidth, kHeight);
  ClgLevel level;
  level.first = m.first.view();
  level.second = m.second.view();
  level.mean = mean.view();
  level.difference = difference.view();
  level.u0 = u0.view();
  level.v0 = v0.view();
  level.u = m.u.view();
  level.v = m.v.view();
  level.j11 = j[0].view();
  level.j12 = j[1].view();
  level.j22 = j[2].view();
  level.j13 = j[3].view();
  level.j23 = j[4].view();
  level.j33 = j[5].view();
  level.system = {split[0].view(), split[1].view(), split[2].view(), split[3].view(), split[4].view(),
                  split[5].view(), split[6].view(), split[7].view(), split[8].view()};
  level.taps = m.k.data();
  level.radius = kRadius;
  level.alpha = 5;
  level.gamma = 2;
  level.data_epsilon2 = 1;
  level.smooth_epsilon2 = 0.01F;
  const Strip warp = [&](int a, int b) { PADE_DISPATCH(clg_warp, set)(level, a, b); };
  const auto seen = [&](int x, int y) { return inside(x + at(level.u0, x, y), y + at(level.v0, x, y)); };
  twins.compare("clg_warp", level.difference, warp, [&](int x, int y) {
    return seen(x, y) ? bilinear(level.second, x + at(level.u0, x, y), y + at(level.v0, x, y)) -
                            at(level.first, x, y)
                      : 0;
  });
  const Strip tensor = [&](int a, int b) { PADE_DISPATCH(clg_tensor, set)(level, a, b, m.scratch.data()); };
  twins.compare("clg_tensor j13", level.j13, tensor, [&](int x, int y) {
    return window(
        [&](int i, int k) {
          if (!seen(i, k)) return 0.0;
          const double xx = at(level.mean, i + 1, k) - 2 * at(level.mean, i, k) + at(level.mean, i - 1, k);
          const double xy = ((at(level.mean, i + 1, k + 1) - at(level.mean, i - 1, k + 1)) -
                             (at(level.mean, i + 1, k - 1) - at(level.mean, i - 1, k - 1))) /
                            4;
          const double xt = (at(level.difference, i + 1, k) - at(level.difference, i - 1, k)) / 2;
          const double yt = (at(level.difference, i, k + 1) - at(level.difference, i, k - 1)) / 2;
          return gradient_x(level.mean, i, k) * at(level.difference, i, k) + 2 * (xx * xt + xy * yt);
        },
        x, y);
  });
  const auto weight = [&](int x, int y, int dx, int dy) {  // between a pixel and its right or lower neighbour
    if (x < 0 || y < 0 || x + dx >= kWidth || y + dy >= kHeight) return 0.0;
    double squared = 0.01;
    for (const PlaneView& w : {level.u, level.v}) {
      const double along = at(w, x + dx, y + dy) - at(w, x, y);
      const double across = (at(w, x + dy, y + dx) - at(w, x - dy, y - dx) + at(w, x + dx + dy, y + dy + dx) -
                             at(w, x + dx - dy, y + dy - dx)) /
                            4;
      squared += along * along + across * across;
    }
    return 5 / std::sqrt(squared);
  };
  std::vector<double> su(kWidth * kHeight), sv(kWidth * kHeight);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      su[static_cast<std::size_t>(y * kWidth + x)] = at(level.u, x, y);
      sv[static_cast<std::size_t>(y * kWidth + x)] = at(level.v, x, y);
    }
  }
  constexpr double kOmega = 1.5;
  constexpr int kSweeps = 3;
  for (int half = 0; half < 2 * kSweeps; ++half) {
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        if ((x + y) % 2 != half % 2) continue;
        const double du = at(level.u, x, y) - at(level.u0, x, y);
        const double dv = at(level.v, x, y) - at(level.v0, x, y);
        const double j11 = at(level.j11, x, y), j12 = at(level.j12, x, y), j22 = at(level.j22, x, y);
        const double j13 = at(level.j13, x, y), j23 = at(level.j23, x, y);
        const double residual = at(level.j33, x, y) + j11 * du * du + 2 * j12 * du * dv + j22 * dv * dv +
                                2 * j13 * du + 2 * j23 * dv;
        const double psi = 1 / std::sqrt(std::max(residual, 0.0) + 1);
        double links = 0;
        double r1 = psi * (j11 * at(level.u0, x, y) + j12 * at(level.v0, x, y) - j13);
        double r2 = psi * (j12 * at(level.u0, x, y) + j22 * at(level.v0, x, y) - j23);
        const int neighbours[4][2] = {{-1, 0}, {1, 0}, {0, -1}, {0, 1}};
        for (const auto& n : neighbours) {
          const int dx = std::abs(n[0]), dy = std::abs(n[1]);
          const double w = weight(std::min(x, x + n[0]), std::min(y, y + n[1]), dx, dy);
          if (w == 0) continue;
          const auto neighbour = static_cast<std::size_t>((y + n[1]) * kWidth + x + n[0]);
          links += w;
          r1 += w * su[neighbour];
          r2 += w * sv[neighbour];
        }
        const double a = psi * j11 + links, b = psi * j12, c = psi * j22 + links;
        auto& u = su[static_cast<std::size_t>(y * kWidth + x)];
        auto& v = sv[static_cast<std::size_t>(y * kWidth + x)];
        u += kOmega * ((c * r1 - b * r2) / (a * c - b * b) - u);
        v += kOmega * ((a * r2 - b * r1) / (a * c - b * b) - v);
      }
    }
  }
  twins.compare(
      "clg_system, clg_relax", m.out.view(),
      [&](int first, int last) {
        if (last != kHeight) return;  // the sweeps need the whole system: built in one go, or in two strips
        const int cut = first == 0 ? kHeight : kHeight / 3;
        PADE_DISPATCH(clg_system, set)(level, 0, cut, m.scratch.data());
        PADE_DISPATCH(clg_system, set)(level, cut, kHeight, m.scratch.data());
        PADE_DISPATCH(clg_split, set)(level.u, level.system.u, 0, kHeight);
        PADE_DISPATCH(clg_split, set)(level.v, level.system.v, 0, kHeight);
        auto* relax = PADE_DISPATCH(clg_relax, set);
        const auto omega = static_cast<float>(kOmega);
        if (first == 0) {
          relax(level.system, kSweeps, omega, {0, 0, kHeight, 0});
        } else {
          relax(level.system, kSweeps, omega, {cut, 1, kHeight, 0});
          relax(level.system, kSweeps, omega, {0, 0, cut, -1});
          relax(level.system, kSweeps, omega, {cut, -1, cut, 1});
        }
        PADE_DISPATCH(clg_join, set)(level.system.u, m.out.view(), 0, kHeight);
      },
      [&](int x, int y) { return su[static_cast<std::size_t>(y * kWidth + x)]; });
}

}  // namespace pade::flow::testing
