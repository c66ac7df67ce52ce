#include "flow/kernel_twins.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <limits>
#include <random>
#include <utility>

#include "pade/flow/kernels/clg_kernels.hpp"
#include "pade/flow/kernels/confidence_kernels.hpp"
#include "pade/flow/kernels/epipolar_kernels.hpp"
#include "pade/flow/kernels/farneback_kernels.hpp"
#include "pade/flow/kernels/lucas_kanade_kernels.hpp"
#include "pade/flow/kernels/pyramid_kernels.hpp"
#include "pade/flow/plane.hpp"
#include "pade/flow/split_plane.hpp"

namespace pade::flow::testing {
namespace {

constexpr int kWidth = 77;  // no multiple of any vector
constexpr int kHeight = 43;
constexpr int kRadius = 3;

double at(const PlaneView& plane, int x, int y) {
  return plane.row(std::clamp(y, 0, plane.height - 1))[std::clamp(x, 0, plane.width - 1)];
}

using Value = std::function<double(int x, int y)>;

Plane filled(int width, int height, const Value& value) {
  Plane plane(width, height);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < plane.stride() && x < padded(width); ++x) {
      plane.row(y)[x] = static_cast<float>(value(std::min(x, width - 1), y));
    }
  }
  return plane;
}

// A smooth picture with noise; and a flow that partly leaves the image.
Plane picture(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-10, 10);
  return filled(kWidth, kHeight, [&](int x, int y) {
    return 120 + 60 * std::sin(0.21 * x + 0.1 * y + seed) + 40 * std::cos(0.33 * y - 0.05 * x * seed) +
           noise(random);
  });
}
Plane flow_component(unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-0.3, 0.3);
  return filled(kWidth, kHeight,
                [&](int x, int y) { return 4 * std::sin(0.05 * x + 0.08 * y + seed) + noise(random); });
}

std::vector<float> taps() {
  std::vector<float> k;
  double sum = 0;
  for (int i = 0; i <= kRadius; ++i) sum += (i == 0 ? 1 : 2) * std::exp(-0.5 * i * i / 2.25);
  for (int i = 0; i <= kRadius; ++i) k.push_back(static_cast<float>(std::exp(-0.5 * i * i / 2.25) / sum));
  return k;
}

// Windowed sum with zeros outside the image.
double window(const Value& value, int x, int y) {
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

double gradient_x(const PlaneView& p, int x, int y) {
  return (8 * (at(p, x + 1, y) - at(p, x - 1, y)) - (at(p, x + 2, y) - at(p, x - 2, y))) / 12;
}
double gradient_y(const PlaneView& p, int x, int y) {
  return (8 * (at(p, x, y + 1) - at(p, x, y - 1)) - (at(p, x, y + 2) - at(p, x, y - 2))) / 12;
}
bool inside(double x, double y) { return x >= 0 && y >= 0 && x <= kWidth - 1 && y <= kHeight - 1; }
double bilinear(const PlaneView& p, double x, double y) {
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
  ConfidenceInput input;
  input.first = m.first.view();
  input.second = m.second.view();
  input.u = m.u.view();
  input.v = m.v.view();
  input.backward_u = m.v.view();
  input.backward_v = m.u.view();
  input.sigma = m.out.view();
  input.taps = m.k.data();
  input.radius = kRadius;
  input.noise = 1;
  input.effective_size = 9;
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
        const double covariance =
            std::max(rr - r * r, 1.0) * (0.5 * (xx + yy) + 1e-4) / (9 * std::max(xx * yy - xy * xy, 1e-8));
        const double eu = at(input.u, x, y) + bilinear(input.backward_u, to_x, to_y);
        const double ev = at(input.v, x, y) + bilinear(input.backward_v, to_x, to_y);
        return std::sqrt(covariance + 0.5 * (eu * eu + ev * ev));
      });
}

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
  for (int half = 0; half < 6; ++half) {
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
        PADE_DISPATCH(clg_relax, set)(level.system, 3, static_cast<float>(kOmega));
        PADE_DISPATCH(clg_join, set)(level.system.u, m.out.view(), 0, kHeight);
      },
      [&](int x, int y) { return su[static_cast<std::size_t>(y * kWidth + x)]; });
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
  return std::move(twins.results);
}

}  // namespace pade::flow::testing
