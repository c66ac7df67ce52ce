#include "flow/kernels/kernel_twins.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>
#include <vector>

#include "pade/flow/kernels/confidence_kernels.hpp"
#include "pade/flow/kernels/farneback_kernels.hpp"
#include "pade/flow/kernels/lucas_kanade_kernels.hpp"
#include "pade/flow/kernels/pyramid_kernels.hpp"

#include "flow/kernels/twin_tools.hpp"

namespace pade::flow::testing {
namespace {

void pyramid_twins(Twins& twins, simd::InstructionSet set, Images& m) {
  const PlaneView in = m.first.view();
  Plane half((kWidth + 1) / 2, (kHeight + 1) / 2);
  constexpr double kBinomial[] = {6.0 / 16, 4.0 / 16, 1.0 / 16};
  twins.compare(
      "downsample", half.view(),
      [&](int a, int b) {
        PADE_DISPATCH(downsample, set)
        (in, half.view(), a, b, m.scratch.data());
      },
      [&](int x, int y) {
        double sum = 0;
        for (int j = -2; j <= 2; ++j) {
          for (int i = -2; i <= 2; ++i)
            sum += kBinomial[std::abs(i)] * kBinomial[std::abs(j)] * at(in, 2 * x + i, 2 * y + j);
        }
        return sum;
      });
  twins.compare(
      "upsample", m.out.view(),
      [&](int a, int b) {
        PADE_DISPATCH(upsample, set)
        (half.view(), m.out.view(), 2, a, b);
      },
      [&](int x, int y) {
        return 0.5 * (at(half.view(), x / 2, y / 2) + at(half.view(), (x + 1) / 2, y / 2) +
                      at(half.view(), x / 2, (y + 1) / 2) + at(half.view(), (x + 1) / 2, (y + 1) / 2));
      });
  twins.compare(
      "smooth", m.out.view(),
      [&](int a, int b) {
        PADE_DISPATCH(smooth, set)(in, m.out.view(), m.k.data(), kRadius, a, b, m.scratch.data());
      },
      [&](int x, int y) {
        double sum = 0;
        for (int j = -kRadius; j <= kRadius; ++j) {
          for (int i = -kRadius; i <= kRadius; ++i) {
            sum += static_cast<double>(m.k[static_cast<std::size_t>(std::abs(i))]) *
                   static_cast<double>(m.k[static_cast<std::size_t>(std::abs(j))]) * at(in, x + i, y + j);
          }
        }
        return sum;
      });
  const Strip both = [&](int a, int b) {
    PADE_DISPATCH(gradient, set)(in, m.out.view(), m.other.view(), a, b, m.scratch.data());
  };
  twins.compare("gradient x", m.out.view(), both, [&](int x, int y) { return gradient_x(in, x, y); });
  twins.compare("gradient y", m.other.view(), both, [&](int x, int y) { return gradient_y(in, x, y); });
  for (const int reach : {1, 2}) {
    twins.compare(
        reach == 1 ? "median3" : "median5", m.out.view(),
        [&](int a, int b) {
          auto* filter = reach == 1 ? PADE_DISPATCH(median3, set) : PADE_DISPATCH(median5, set);
          filter(in, m.out.view(), a, b, m.scratch.data());
        },
        [&](int x, int y) {
          std::vector<double> values;
          for (int j = -reach; j <= reach; ++j) {
            for (int i = -reach; i <= reach; ++i) values.push_back(at(in, x + i, y + j));
          }
          std::sort(values.begin(), values.end());
          return values[values.size() / 2];
        });
  }
}

void lucas_kanade_twins(Twins& twins, simd::InstructionSet set, Images& m) {
  Plane gx = filled(kWidth, kHeight, [&](int x, int y) { return gradient_x(m.first.view(), x, y); });
  Plane gy = filled(kWidth, kHeight, [&](int x, int y) { return gradient_y(m.first.view(), x, y); });
  Plane ixx(kWidth, kHeight), ixy(kWidth, kHeight), iyy(kWidth, kHeight);
  Plane used = filled(kWidth, kHeight, [](int x, int y) { return x < 20 && y > 30 ? 0 : 1; });
  LucasKanadeLevel level;
  level.first = m.first.view();
  level.second = m.second.view();
  level.mask = used.view();
  level.gradient_x = gx.view();
  level.gradient_y = gy.view();
  level.inverse_xx = ixx.view();
  level.inverse_xy = ixy.view();
  level.inverse_yy = iyy.view();
  level.u = m.u.view();
  level.v = m.v.view();
  level.next_u = m.out.view();
  level.next_v = m.other.view();
  level.taps = m.k.data();
  level.radius = kRadius;
  level.damping = 2;
  level.largest_step = 1.5F;
  const auto tensor = [&](int x, int y) {
    const auto sum = [&](const Plane& a, const Plane& b) {
      return window(
          [&](int i, int j) { return at(used.view(), i, j) * at(a.view(), i, j) * at(b.view(), i, j); }, x,
          y);
    };
    return std::array<double, 3>{sum(gx, gx) + 2, sum(gx, gy), sum(gy, gy) + 2};
  };
  twins.compare(
      "lucas_kanade_prepare", level.inverse_xy,
      [&](int a, int b) {
        PADE_DISPATCH(lucas_kanade_prepare, set)
        (level, a, b, m.scratch.data());
      },
      [&](int x, int y) {
        const auto g = tensor(x, y);
        return -g[1] / (g[0] * g[2] - g[1] * g[1]);
      });
  twins.compare(
      "lucas_kanade_iterate", level.next_u,
      [&](int a, int b) {
        PADE_DISPATCH(lucas_kanade_iterate, set)
        (level, a, b, m.scratch.data());
      },
      [&](int x, int y) {
        const auto side = [&](const Plane& g) {
          return window(
              [&](int i, int j) {
                const double u = at(level.u, i, j);
                const double v = at(level.v, i, j);
                const double residual =
                    inside(i + u, j + v) ? bilinear(level.second, i + u, j + v) - at(level.first, i, j) : 0;
                return at(used.view(), i, j) * at(g.view(), i, j) *
                       (at(gx.view(), i, j) * u + at(gy.view(), i, j) * v - residual);
              },
              x, y);
        };
        const auto g = tensor(x, y);
        const double bx = side(gx) + 2 * at(level.u, x, y);
        const double by = side(gy) + 2 * at(level.v, x, y);
        const double u = (g[2] * bx - g[1] * by) / (g[0] * g[2] - g[1] * g[1]);
        return at(level.u, x, y) + std::clamp(u - at(level.u, x, y), -1.5, 1.5);
      });
}

void farneback_twins(Twins& twins, simd::InstructionSet set, Images& m) {
  std::vector<float> xg, xxg;
  double m2 = 0;
  double m4 = 0;
  for (int i = 0; i <= kRadius; ++i) {
    const float g = m.k[static_cast<std::size_t>(i)];
    xg.push_back(static_cast<float>(i) * g);
    xxg.push_back(static_cast<float>(i * i) * g);
    m2 += 2.0 * i * i * static_cast<double>(g);
    m4 += 2.0 * std::pow(i, 4) * static_cast<double>(g);
  }
  const double square = 1 / (m4 - m2 * m2);
  ExpansionFilters filters{m.k.data(),
                           xg.data(),
                           xxg.data(),
                           kRadius,
                           static_cast<float>(1 / m2),
                           static_cast<float>(-m2 * square),
                           static_cast<float>(square),
                           static_cast<float>(1 / (m2 * m2))};
  Plane planes[10];
  for (Plane& plane : planes) plane.resize(kWidth, kHeight);
  FarnebackLevel level;
  level.first = {planes[0].view(), planes[1].view(), planes[2].view(), planes[3].view(), planes[4].view()};
  level.second = {planes[5].view(), planes[6].view(), planes[7].view(), planes[8].view(), planes[9].view()};
  PADE_DISPATCH(farneback_expand, set)(m.second.view(), level.second, filters, 0, kHeight, m.scratch.data());
  // Moments of the Gaussian-weighted neighbourhood.
  const auto moment = [&](int px, int py, int x, int y) {
    double sum = 0;
    for (int j = -kRadius; j <= kRadius; ++j) {
      for (int i = -kRadius; i <= kRadius; ++i) {
        sum += static_cast<double>(m.k[static_cast<std::size_t>(std::abs(i))]) *
               static_cast<double>(m.k[static_cast<std::size_t>(std::abs(j))]) * std::pow(i, px) *
               std::pow(j, py) * at(m.first.view(), x + i, y + j);
      }
    }
    return sum;
  };
  const Strip expand = [&](int a, int b) {
    PADE_DISPATCH(farneback_expand, set)(m.first.view(), level.first, filters, a, b, m.scratch.data());
  };
  twins.compare("farneback_expand by", level.first.by, expand,
                [&](int x, int y) { return moment(0, 1, x, y) / m2; });
  twins.compare("farneback_expand axx", level.first.axx, expand,
                [&](int x, int y) { return square * (moment(2, 0, x, y) - m2 * moment(0, 0, x, y)); });
  twins.compare("farneback_expand axy", level.first.axy, expand,
                [&](int x, int y) { return moment(1, 1, x, y) / (m2 * m2); });
  level.u = m.u.view();
  level.v = m.v.view();
  level.next_u = m.out.view();
  level.next_v = m.other.view();
  level.taps = m.k.data();
  level.radius = kRadius;
  level.damping = 0.5F;
  level.largest_step = 2;
  twins.compare(
      "farneback_iterate", level.next_v,
      [&](int a, int b) {
        PADE_DISPATCH(farneback_iterate, set)
        (level, a, b, m.scratch.data());
      },
      [&](int x, int y) {
        const auto sum = [&](int which) {
          return window(
              [&](int i, int j) {
                const int du = static_cast<int>(std::lround(at(level.u, i, j)));
                const int dv = static_cast<int>(std::lround(at(level.v, i, j)));
                if (!inside(i + du, j + dv)) return 0.0;
                const auto mean = [&](const PlaneView& a, const PlaneView& b) {
                  return 0.5 * (at(a, i, j) + at(b, i + du, j + dv));
                };
                const double xx = mean(level.first.axx, level.second.axx);
                const double yy = mean(level.first.ayy, level.second.ayy);
                const double xy = 0.5 * mean(level.first.axy, level.second.axy);
                const double bx = 0.5 * (at(level.first.bx, i, j) - at(level.second.bx, i + du, j + dv)) +
                                  xx * du + xy * dv;
                const double by = 0.5 * (at(level.first.by, i, j) - at(level.second.by, i + du, j + dv)) +
                                  xy * du + yy * dv;
                const double products[] = {xx * xx + xy * xy, xy * (xx + yy), yy * yy + xy * xy,
                                           xx * bx + xy * by, xy * bx + yy * by};
                return products[which];
              },
              x, y);
        };
        const double a = sum(0) + 0.5;
        const double b = sum(1);
        const double c = sum(2) + 0.5;
        const double hx = sum(3) + 0.5 * at(level.u, x, y);
        const double hy = sum(4) + 0.5 * at(level.v, x, y);
        const double v = (a * hy - b * hx) / (a * c - b * b);
        return at(level.v, x, y) + std::clamp(v - at(level.v, x, y), -2.0, 2.0);
      });
}

void confidence_twin(Twins& twins, simd::InstructionSet set, Images& m) {
  // A texture, the same in both on the left but for its brightness; on the right no match is right.
  const auto waves = [](int x, int y, double k) {
    return 120 + 40 * std::sin(k * x) + 30 * std::cos(0.8 * k * y) + 30 * std::sin(k * (0.9 * x + 1.1 * y)) +
           25 * std::cos(k * (1.2 * x - 0.7 * y));
  };
  const Plane first = filled(kWidth, kHeight, [&](int x, int y) { return waves(x, y, 0.13); });
  const Plane second = filled(kWidth, kHeight, [&](int x, int y) {
    return x < kWidth / 2 ? waves(x, y, 0.13) - 2 : waves(y, x, 0.4);
  });
  ConfidenceInput input;
  input.first = first.view();
  input.second = second.view();
  input.u = m.u.view();
  input.v = m.v.view();
  input.backward_u = m.v.view();
  input.backward_v = m.u.view();
  input.sigma = m.out.view();
  input.taps = m.k.data();
  input.radius = kRadius;
  input.noise = 1;
  input.scale = 2;
  input.effective_size = 9;
  int wrong_matches = 0;
  int right_matches = 0;
  twins.compare(
      "flow_sigma", input.sigma,
      [&](int a, int b) {
        PADE_DISPATCH(flow_sigma, set)
        (input, a, b, m.scratch.data());
      },
      [&](int x, int y) {
        const double to_x = x + at(input.u, x, y);
        const double to_y = y + at(input.v, x, y);
        if (!inside(to_x, to_y)) return std::numeric_limits<double>::infinity();
        const auto gx = [&](int i, int j) { return gradient_x(input.first, i, j); };
        const auto gy = [&](int i, int j) { return gradient_y(input.first, i, j); };
        const auto residual = [&](int i, int j) {
          return bilinear(input.second, i + at(input.u, i, j), j + at(input.v, i, j)) - at(input.first, i, j);
        };
        const double xx = window([&](int i, int j) { return gx(i, j) * gx(i, j); }, x, y);
        const double xy = window([&](int i, int j) { return gx(i, j) * gy(i, j); }, x, y);
        const double yy = window([&](int i, int j) { return gy(i, j) * gy(i, j); }, x, y);
        const double r = window(residual, x, y);
        const double rr = window([&](int i, int j) { return residual(i, j) * residual(i, j); }, x, y);
        const auto clamped = [&](int i, int j) {
          return residual(std::clamp(i, 0, kWidth - 1), std::clamp(j, 0, kHeight - 1));
        };
        const double left = window(
            [&](int i, int j) {
              const double rx = 0.5 * (clamped(i + 1, j) - clamped(i - 1, j));
              const double ry = 0.5 * (clamped(i, j + 1) - clamped(i, j - 1));
              return rx * rx + ry * ry;
            },
            x, y);
        const double limit = 0.1 + 0.5 / (1 + input.scale * std::hypot(at(input.u, x, y), at(input.v, x, y)));
        const bool wrong = left - 2 > limit * (2 * (xx + yy) + 2);
        ++(wrong ? wrong_matches : right_matches);
        if (wrong) return std::numeric_limits<double>::infinity();
        const double covariance =
            std::max(rr - r * r, 1.0) * (0.5 * (xx + yy) + 1e-4) / (9 * std::max(xx * yy - xy * xy, 1e-8));
        const double eu = at(input.u, x, y) + bilinear(input.backward_u, to_x, to_y);
        const double ev = at(input.v, x, y) + bilinear(input.backward_v, to_x, to_y);
        return std::sqrt(covariance + 0.5 * (eu * eu + ev * ev));
      });
  const int fewest = kWidth * kHeight / 20;
  if (wrong_matches < fewest || right_matches < fewest) twins.results.back().strips_agree = false;
}

}  // namespace

std::vector<TwinResult> run_kernel_twins(simd::InstructionSet set) {
  Twins twins;
  Images images;
  pyramid_twins(twins, set, images);
  lucas_kanade_twins(twins, set, images);
  farneback_twins(twins, set, images);
  confidence_twin(twins, set, images);
  clg_twins(twins, set, images);
  epipolar_twins(twins, set, images);
  multi_view_twins(twins, set, images);
  return std::move(twins.results);
}

}  // namespace pade::flow::testing
