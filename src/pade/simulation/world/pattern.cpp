// The procedural patterns: periodic tiles drawn once from hashed noise.
#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

#include "pade/simulation/world/texture.hpp"

namespace pade::simulation {
namespace {

constexpr int kPixels = 1024;

std::uint32_t hash(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
  std::uint32_t h = x * 0x9e3779b1U ^ (y * 0x85ebca77U + 0x27d4eb2fU) ^ (seed * 0xc2b2ae3dU);
  h ^= h >> 15;
  h *= 0x2c1b3c6dU;
  h ^= h >> 12;
  h *= 0x297a2d39U;
  return h ^ (h >> 15);
}

/// In [0, 1).
float random_at(int x, int y, std::uint32_t seed) {
  return static_cast<float>(hash(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), seed) >> 8) *
         0x1.0p-24F;
}

float smooth(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }

/// Adds weight * (value noise in [-1, 1]) with `cells_x` x `cells_y` lattice cells over the image.
void add_octave(cv::Mat& image, int cells_x, int cells_y, float weight, std::uint32_t seed) {
  std::vector<float> fraction(static_cast<std::size_t>(image.cols));
  std::vector<int> left(static_cast<std::size_t>(image.cols));
  for (int x = 0; x < image.cols; ++x) {
    const float u = static_cast<float>(x) * static_cast<float>(cells_x) / static_cast<float>(image.cols);
    left[static_cast<std::size_t>(x)] = static_cast<int>(u);
    fraction[static_cast<std::size_t>(x)] = smooth(u - std::floor(u));
  }
  std::vector<float> upper(static_cast<std::size_t>(cells_x) + 1);
  std::vector<float> lower(upper.size());
  for (int y = 0; y < image.rows; ++y) {
    const float v = static_cast<float>(y) * static_cast<float>(cells_y) / static_cast<float>(image.rows);
    const int top = static_cast<int>(v);
    const float fy = smooth(v - static_cast<float>(top));
    for (int c = 0; c <= cells_x; ++c) {
      const int column = c % cells_x;
      upper[static_cast<std::size_t>(c)] = random_at(column, top % cells_y, seed);
      lower[static_cast<std::size_t>(c)] = random_at(column, (top + 1) % cells_y, seed);
    }
    auto* row = image.ptr<float>(y);
    for (int x = 0; x < image.cols; ++x) {
      const auto c = static_cast<std::size_t>(left[static_cast<std::size_t>(x)]);
      const float fx = fraction[static_cast<std::size_t>(x)];
      const float a = (1 - fx) * upper[c] + fx * upper[c + 1];
      const float b = (1 - fx) * lower[c] + fx * lower[c + 1];
      row[x] += weight * (2 * ((1 - fy) * a + fy * b) - 1);
    }
  }
}

/// Nearest and second nearest of one jittered point per cell (Worley noise), and the nearest point's cell.
struct Stone {
  float gap;  ///< distance to the border between the two nearest, in cells
  int column;
  int row;
};

Stone nearest_stone(float u, float v, int cells, std::uint32_t seed) {
  const int cu = static_cast<int>(u);
  const int cv = static_cast<int>(v);
  float first = 1e9F;
  float second = 1e9F;
  Stone stone{0, 0, 0};
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      const int column = (cu + du + cells) % cells;
      const int row = (cv + dv + cells) % cells;
      const float px = static_cast<float>(cu + du) + random_at(column, row, seed);
      const float py = static_cast<float>(cv + dv) + random_at(column, row, seed + 1);
      const float distance = std::hypot(px - u, py - v);
      if (distance < first) {
        second = first;
        first = distance;
        stone.column = column;
        stone.row = row;
      } else {
        second = std::min(second, distance);
      }
    }
  }
  stone.gap = second - first;
  return stone;
}

using Colour = cv::Vec3f;

/// Draws every pixel of a tile from its position and the noise images at it.
template <class Paint>
PatternTile paint(float size, const Paint& colour) {
  PatternTile tile{cv::Mat(kPixels, kPixels, CV_32FC3), size};
  for (int y = 0; y < kPixels; ++y) {
    for (int x = 0; x < kPixels; ++x) {
      const Colour c = colour(x, y);
      tile.pixels.at<Colour>(y, x) = {std::clamp(c[0], 0.01F, 0.95F), std::clamp(c[1], 0.01F, 0.95F),
                                      std::clamp(c[2], 0.01F, 0.95F)};
    }
  }
  return tile;
}

float at(const cv::Mat& noise, int x, int y) { return noise.at<float>(y, x); }

PatternTile plaster() {
  const cv::Mat stains = draw_noise(kPixels, 3, 3, 4, 0.5F, 1);
  const cv::Mat grain = draw_noise(kPixels, 32, 32, 5, 0.85F, 2);  // trowel marks and sand
  return paint(4, [&](int x, int y) {
    const float tone = 1 + 0.20F * at(stains, x, y) + 0.28F * at(grain, x, y);
    return tone * Colour(0.68F, 0.64F, 0.56F);
  });
}

PatternTile brick() {
  constexpr int kColumns = 16;  // of 25 cm in 4 m
  constexpr int kRows = 48;     // of 8.3 cm
  const cv::Mat grain = draw_noise(kPixels, 96, 96, 3, 0.7F, 3);
  const cv::Mat stains = draw_noise(kPixels, 4, 4, 4, 0.6F, 4);
  return paint(4, [&](int x, int y) {
    const float v = (static_cast<float>(y) + 0.5F) * kRows / kPixels;
    const int row = static_cast<int>(v);
    const float shift = (row % 2 == 0) ? 0 : 0.5F;
    const float u = (static_cast<float>(x) + 0.5F) * kColumns / kPixels + shift;
    const int column = static_cast<int>(u) % kColumns;
    const float du = u - std::floor(u);
    const float dv = v - std::floor(v);
    const bool mortar = du < 0.045F || dv < 0.13F;
    const float dirt = 1 + 0.12F * at(stains, x, y) + 0.16F * at(grain, x, y);
    if (mortar) return dirt * Colour(0.42F, 0.40F, 0.37F);
    const float tone = 0.65F + 0.7F * random_at(column, row, 5);
    const float red = 0.9F + 0.3F * random_at(column, row, 6);
    return dirt * tone * Colour(0.34F * red, 0.15F, 0.10F);
  });
}

PatternTile bark() {
  const cv::Mat ridges = draw_noise(kPixels, 24, 5, 5, 0.6F, 7);
  const cv::Mat grain = draw_noise(kPixels, 128, 32, 3, 0.7F, 8);
  return paint(2, [&](int x, int y) {
    const float ridge = 1 - 1.6F * std::abs(at(ridges, x, y));
    const float tone = 0.45F + 0.75F * ridge + 0.25F * at(grain, x, y);
    return tone * Colour(0.22F, 0.16F, 0.11F);
  });
}

PatternTile grass() {
  const cv::Mat patches = draw_noise(kPixels, 4, 4, 5, 0.6F, 9);
  const cv::Mat blades = draw_noise(kPixels, 64, 64, 4, 0.9F, 10);
  const cv::Mat dry = draw_noise(kPixels, 6, 6, 6, 0.7F, 11);
  return paint(4, [&](int x, int y) {
    const float tone = 0.9F + 0.35F * at(patches, x, y) + 0.55F * at(blades, x, y);
    const float yellow = std::clamp(0.3F + 0.6F * at(dry, x, y), 0.0F, 1.0F);
    return tone * (yellow * Colour(0.24F, 0.20F, 0.09F) + (1 - yellow) * Colour(0.09F, 0.17F, 0.04F));
  });
}

PatternTile concrete() {
  const cv::Mat stains = draw_noise(kPixels, 3, 4, 6, 0.6F, 12);
  const cv::Mat grain = draw_noise(kPixels, 32, 32, 5, 0.85F, 13);
  return paint(4, [&](int x, int y) {
    const bool seam = x % (kPixels / 2) < 2 || y % (kPixels / 4) < 2;  // formwork: 2 m x 1 m
    const float pit = random_at(x / 3, y / 3, 14) > 0.9985F ? 0.6F : 1;
    const float tone = (1 + 0.26F * at(stains, x, y) + 0.32F * at(grain, x, y)) * (seam ? 0.75F : 1) * pit;
    return tone * Colour(0.44F, 0.43F, 0.41F);
  });
}

PatternTile gravel() {
  constexpr int kCells = 72;  // stones of 5.5 cm
  const cv::Mat dust = draw_noise(kPixels, 4, 4, 7, 0.7F, 15);
  return paint(4, [&](int x, int y) {
    const float scale = static_cast<float>(kCells) / kPixels;
    const Stone stone = nearest_stone((static_cast<float>(x) + 0.5F) * scale,
                                      (static_cast<float>(y) + 0.5F) * scale, kCells, 16);
    const float tone =
        (0.5F + 0.8F * random_at(stone.column, stone.row, 18)) * std::min(1.0F, 0.35F + 2.2F * stone.gap);
    return (tone * (1 + 0.25F * at(dust, x, y))) * Colour(0.40F, 0.37F, 0.33F);
  });
}

PatternTile asphalt() {
  const cv::Mat patches = draw_noise(kPixels, 3, 3, 5, 0.6F, 19);
  const cv::Mat grain = draw_noise(kPixels, 64, 64, 4, 0.95F, 20);
  return paint(4, [&](int x, int y) {
    const float chip = random_at(x / 2, y / 2, 21) > 0.97F ? 1.7F : 1;
    const float tone = (1 + 0.22F * at(patches, x, y) + 0.34F * at(grain, x, y)) * chip;
    return tone * Colour(0.13F, 0.13F, 0.135F);
  });
}

/// The leaf that lies on top at a point, of those scattered one per cell: long, turned and overlapping.
struct Leaf {
  float across = 0;  ///< -1 to 1 from edge to edge
  float tone = 0;
  float yellow = 0;
};

Leaf topmost_leaf(float u, float v, int cells, std::uint32_t seed) {
  Leaf leaf{0, 0.25F, 0};  // the dark between leaves
  float highest = -1;
  const int cu = static_cast<int>(u);
  const int cv = static_cast<int>(v);
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      const int column = (cu + du + cells) % cells;
      const int row = (cv + dv + cells) % cells;
      const float height = random_at(column, row, seed + 2);
      if (height < highest) continue;
      const float x = static_cast<float>(cu + du) + random_at(column, row, seed) - u;
      const float y = static_cast<float>(cv + dv) + random_at(column, row, seed + 1) - v;
      const float angle = 6.2831853F * random_at(column, row, seed + 3);
      const float along = (std::cos(angle) * x + std::sin(angle) * y) / 1.05F;
      const float across = (std::cos(angle) * y - std::sin(angle) * x) / 0.52F;
      const float width = 1 - along * along;  // pointed at both ends
      if (width <= 0 || std::abs(across) > width) continue;
      highest = height;
      leaf = {across / width, 0.45F + 0.95F * height, random_at(column, row, seed + 4)};
    }
  }
  return leaf;
}

PatternTile leaves() {
  constexpr int kCells = 24;  // 4 cm
  const cv::Mat shade = draw_noise(kPixels, 4, 4, 5, 0.6F, 22);
  return paint(1, [&](int x, int y) {
    const float scale = static_cast<float>(kCells) / kPixels;
    const Leaf leaf = topmost_leaf((static_cast<float>(x) + 0.5F) * scale,
                                   (static_cast<float>(y) + 0.5F) * scale, kCells, 23);
    const float rib = std::abs(leaf.across) < 0.08F ? 1.25F : 1 + 0.2F * leaf.across;
    return (leaf.tone * rib * (1 + 0.3F * at(shade, x, y))) *
           Colour(0.08F + 0.09F * leaf.yellow, 0.19F, 0.05F);
  });
}

}  // namespace

cv::Mat draw_noise(int pixels, int coarsest_x, int coarsest_y, int octaves, float gain, std::uint32_t seed) {
  cv::Mat image = cv::Mat::zeros(pixels, pixels, CV_32FC1);
  float weight = 1;
  float total = 0;
  for (int i = 0; i < octaves; ++i) {
    const int cells_x = coarsest_x << i;
    const int cells_y = coarsest_y << i;
    if (std::max(cells_x, cells_y) > pixels / 2) break;  // finer than the image
    add_octave(image, cells_x, cells_y, weight, seed * 64 + static_cast<std::uint32_t>(i));
    total += weight * weight;
    weight *= gain;
  }
  return image * (1.4F / std::sqrt(total));
}

PatternTile draw_pattern(PatternKind kind) {
  switch (kind) {
    case PatternKind::plaster:
      return plaster();
    case PatternKind::brick:
      return brick();
    case PatternKind::bark:
      return bark();
    case PatternKind::grass:
      return grass();
    case PatternKind::concrete:
      return concrete();
    case PatternKind::gravel:
      return gravel();
    case PatternKind::asphalt:
      return asphalt();
    case PatternKind::leaves:
      return leaves();
    case PatternKind::none:
      break;
  }
  return {cv::Mat(1, 1, CV_32FC3, cv::Scalar::all(1)), 1};
}

}  // namespace pade::simulation
