#include "pade/simulation/generator/mesh_generator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numbers>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

namespace pade::simulation {
namespace {

class ObjText {
 public:
  int vertex(const Eigen::Vector3d& p) {
    fmt::format_to(std::back_inserter(text_), "v {:.3f} {:.3f} {:.3f}\n", p.x(), p.y(), p.z());
    return ++vertices_;
  }
  void triangle(int a, int b, int c) { fmt::format_to(std::back_inserter(faces_), "f {} {} {}\n", a, b, c); }
  [[nodiscard]] std::string str() const { return text_ + faces_; }

 private:
  std::string text_;
  std::string faces_;
  int vertices_ = 0;
};

/// A tapering tube along a polyline.
void tube(ObjText& out, const std::vector<Eigen::Vector3d>& path, double from_radius, double to_radius,
          int sides) {
  std::vector<int> before;
  Eigen::Vector3d x = Eigen::Vector3d::UnitX();  // carried along, so that the rings do not twist
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Eigen::Vector3d along =
        (path[std::min(i + 1, path.size() - 1)] - path[i > 0 ? i - 1 : 0]).normalized();
    x -= along * along.dot(x);
    x = x.norm() > 0.1 ? Eigen::Vector3d(x.normalized()) : along.unitOrthogonal();
    const Eigen::Vector3d y = along.cross(x);
    const double radius = from_radius + (to_radius - from_radius) * static_cast<double>(i) /
                                            static_cast<double>(path.size() - 1);
    std::vector<int> ring;
    for (int k = 0; k < sides; ++k) {
      const double angle = 2 * std::numbers::pi * k / sides;
      ring.push_back(out.vertex(path[i] + radius * (std::cos(angle) * x + std::sin(angle) * y)));
    }
    for (std::size_t k = 0; !before.empty() && k < ring.size(); ++k) {
      const std::size_t next = (k + 1) % ring.size();
      out.triangle(before[k], ring[k], ring[next]);
      out.triangle(before[k], ring[next], before[next]);
    }
    before = ring;
  }
}

/// The surface between rings of equally many corners; the first and the last ring are one corner each.
void close_rings(ObjText& out, const std::vector<std::vector<int>>& rings) {
  for (std::size_t i = 0; i + 1 < rings.size(); ++i) {
    for (std::size_t k = 0; k < std::max(rings[i].size(), rings[i + 1].size()); ++k) {
      const auto at = [&](std::size_t ring, std::size_t index) {
        return rings[ring][index % rings[ring].size()];
      };
      if (i + 2 < rings.size()) out.triangle(at(i, k), at(i + 1, k), at(i + 1, k + 1));
      if (i > 0) out.triangle(at(i, k), at(i + 1, k + 1), at(i, k + 1));
    }
  }
}

/// A rhombic leaf about a point.
void leaf(ObjText& out, const Eigen::Vector3d& at, double length, Random& random) {
  Eigen::Vector3d along = random.normal3().normalized();
  along.z() = 0.5 * along.z() - 0.2;  // leaves hang
  along.normalize();
  const Eigen::Vector3d across = along.cross(random.normal3()).normalized();
  const int root = out.vertex(at - 0.5 * length * along);
  const int left = out.vertex(at + 0.32 * length * across);
  const int tip = out.vertex(at + 0.5 * length * along);
  const int right = out.vertex(at - 0.32 * length * across);
  out.triangle(root, left, tip);
  out.triangle(root, tip, right);
}

/// A ball of foliage, flattened and ragged.
void tuft(ObjText& out, const Eigen::Vector3d& at, double radius, Random& random) {
  constexpr int kRings = 5;
  constexpr int kAround = 8;
  std::vector<std::vector<int>> rings;
  for (int i = 0; i <= kRings; ++i) {
    const double polar = std::numbers::pi * i / kRings;
    std::vector<int> ring;
    const int count = (i == 0 || i == kRings) ? 1 : kAround;
    for (int k = 0; k < count; ++k) {
      const double azimuth = 2 * std::numbers::pi * (k + 0.5 * (i % 2)) / kAround;
      const Eigen::Vector3d direction(std::sin(polar) * std::cos(azimuth),
                                      std::sin(polar) * std::sin(azimuth), 0.75 * std::cos(polar));
      ring.push_back(out.vertex(at + radius * random.uniform(0.75, 1.25) * direction));
    }
    rings.push_back(ring);
  }
  close_rings(out, rings);
}

}  // namespace

TreeMeshes grow_tree(const TreeShape& shape, Random& random) {
  ObjText wood;
  ObjText leaves;
  const double height = shape.height * random.uniform(0.88, 1.12);
  const double radius = shape.trunk_radius * random.uniform(0.82, 1.18);
  std::vector<Eigen::Vector3d> trunk = {{0, 0, -0.3}};
  constexpr int kSteps = 6;
  for (int i = 1; i <= kSteps; ++i) {
    const double bend = 0.05 * i;
    const double y = random.uniform(-bend, bend);
    const double x = random.uniform(-bend, bend);
    trunk.emplace_back(x, y, height * i / kSteps);
  }
  tube(wood, trunk, 1.15 * radius, 0.25 * radius, 10);
  const int branches = 11 + static_cast<int>(4 * random.uniform());
  for (int b = 0; b < branches; ++b) {
    const double share = shape.crown_base + (0.98 - shape.crown_base) * (b + random.uniform()) / branches;
    const auto below = static_cast<std::size_t>(share * kSteps);
    const double between = share * kSteps - static_cast<double>(below);
    const Eigen::Vector3d root =
        (1 - between) * trunk[below] + between * trunk[std::min<std::size_t>(below + 1, kSteps)];
    const double azimuth = 2.4 * b + random.uniform(-0.4, 0.4);
    const double length = (1.15 - 0.75 * share) * random.uniform(2.0, 3.0);
    std::vector<Eigen::Vector3d> path = {root};
    for (int i = 1; i <= 4; ++i) {
      const double r = length * i / 4;
      path.push_back(root +
                     Eigen::Vector3d(r * std::cos(azimuth), r * std::sin(azimuth), 0.45 * r + 0.06 * r * r) +
                     0.07 * random.normal3());
    }
    tube(wood, path, 0.35 * radius, 0.06 * radius, 6);
    // Dense foliage about the outer half of the branch, and loose leaves where it thins out.
    for (const std::size_t k : {2, 4}) {
      const double size = (k == 2 ? 0.24 : 0.33) * length * random.uniform(0.85, 1.15);
      tuft(leaves, path[k] + 0.05 * length * random.normal3(), size, random);
    }
    for (int i = 0; i < 26; ++i) {
      const double along = random.uniform(0.4, 1.0) * 4;
      const auto k = std::min<std::size_t>(static_cast<std::size_t>(along), 3);
      const Eigen::Vector3d at = path[k] + (along - static_cast<double>(k)) * (path[k + 1] - path[k]);
      const double size = random.uniform(0.14, 0.26);
      leaf(leaves, at + 0.2 * length * random.normal3(), size, random);
    }
  }
  return {wood.str(), leaves.str()};
}

std::string break_stone(Random& random) {
  ObjText out;
  // An octahedron divided twice, each corner pushed in or out and cut off by random planes.
  std::array<Eigen::Vector3d, 7> cuts;
  for (auto& cut : cuts) cut = random.normal3().normalized();
  const double rough = random.uniform(0.03, 0.08);
  const auto surface = [&](const Eigen::Vector3d& direction) -> Eigen::Vector3d {
    double radius = 0.55;
    for (const auto& cut : cuts) {
      const double facing = direction.normalized().dot(cut);
      if (facing > 0.3) radius = std::min(radius, 0.4 / facing);
    }
    return radius * (1 + rough * random.normal()) * direction.normalized();
  };
  constexpr int kRings = 7;
  constexpr int kAround = 10;
  std::vector<std::vector<int>> rings;
  for (int i = 0; i <= kRings; ++i) {
    const double polar = std::numbers::pi * i / kRings;
    std::vector<int> ring;
    const int count = (i == 0 || i == kRings) ? 1 : kAround;
    for (int k = 0; k < count; ++k) {
      const double azimuth = 2 * std::numbers::pi * (k + 0.5 * (i % 2)) / kAround;
      ring.push_back(out.vertex(surface(
          {std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth), std::cos(polar)})));
    }
    rings.push_back(ring);
  }
  close_rings(out, rings);
  return out.str();
}

}  // namespace pade::simulation
