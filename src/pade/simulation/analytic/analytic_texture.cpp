#include "pade/simulation/analytic/analytic_texture.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace pade::simulation {
namespace {

std::uint32_t hash(std::int64_t x, std::int64_t y, std::int64_t z, std::uint32_t seed) {
  std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8da6b343U ^
                    static_cast<std::uint32_t>(y) * 0xd8163841U ^
                    static_cast<std::uint32_t>(z) * 0xcb1ab31fU ^ seed * 0x9e3779b9U;
  h ^= h >> 16;  // murmur3's finaliser
  h *= 0x85ebca6bU;
  h ^= h >> 13;
  h *= 0xc2b2ae35U;
  return h ^ (h >> 16);
}

/// Dot product with one of the twelve edge directions of a cube (four of them twice, to make sixteen).
double gradient(std::uint32_t h, double x, double y, double z) {
  const std::uint32_t kind = h & 15U;
  const double u = kind < 8 ? x : y;
  const double v = kind < 4 ? y : (kind == 12 || kind == 14 ? x : z);
  return ((kind & 1U) == 0 ? u : -u) + ((kind & 2U) == 0 ? v : -v);
}

double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }
double mix(double a, double b, double t) { return a + t * (b - a); }

/// Integral from 0 to x of a square wave that is 1 within duty/2 of each multiple of the period plus
/// period/2.
double square_wave_integral(double x, double period, double duty) {
  const double periods = std::floor(x / period);
  const double rest = x - periods * period;
  return periods * duty + std::clamp(rest - 0.5 * (period - duty), 0.0, duty);
}

}  // namespace

double gradient_noise(const Eigen::Vector3d& point, std::uint32_t seed) {
  const double fx = std::floor(point.x());
  const double fy = std::floor(point.y());
  const double fz = std::floor(point.z());
  const auto ix = static_cast<std::int64_t>(fx);
  const auto iy = static_cast<std::int64_t>(fy);
  const auto iz = static_cast<std::int64_t>(fz);
  const double x = point.x() - fx;
  const double y = point.y() - fy;
  const double z = point.z() - fz;
  const double u = fade(x);
  const double v = fade(y);
  const auto row = [&](int dy, int dz) {
    return mix(gradient(hash(ix, iy + dy, iz + dz, seed), x, y - dy, z - dz),
               gradient(hash(ix + 1, iy + dy, iz + dz, seed), x - 1, y - dy, z - dz), u);
  };
  return mix(mix(row(0, 0), row(1, 0), v), mix(row(0, 1), row(1, 1), v), fade(z));
}

double band_limited_noise(const Eigen::Vector3d& point, double coarsest, double finest, double footprint,
                          std::uint32_t seed) {
  double sum = 0;
  double power = 0;  // of all octaves, so that fading the fine ones lowers the contrast as a blur does
  double amplitude = 1;
  std::uint32_t octave = 0;
  for (double spacing = coarsest; spacing >= finest; spacing *= 0.5, ++octave) {
    const double weight = std::clamp((spacing / footprint - 2.5) / 2.5, 0.0, 1.0);
    if (weight > 0) sum += fade(weight) * amplitude * gradient_noise(point / spacing, seed + 101 * octave);
    power += amplitude * amplitude;
    amplitude *= 0.92;
  }
  return power > 0 ? 1.6 * sum / std::sqrt(power) : 0;
}

double filtered_square_wave(double x, double width, double period, double duty) {
  const double half = 0.5 * std::max(width, 1e-9);
  return (square_wave_integral(x + half, period, duty) - square_wave_integral(x - half, period, duty)) /
         (2 * half);
}

}  // namespace pade::simulation
