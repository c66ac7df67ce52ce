#include "pade/simulation/generator/open_world_scene.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <queue>
#include <vector>

#include <fmt/format.h>

#include "pade/simulation/generator/world_generator.hpp"
#include "pade/simulation/sdf/sdf_reader.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;
constexpr double kStep = 0.25;
constexpr int kAttempts = 10;

/// Cells about the way, searched from the start toward the goal, the nearest to it first.
class PassageSearch {
 public:
  PassageSearch(const SurfaceDistance& surface, const Vector3d& start, const Vector3d& goal,
                const PassageOptions& options)
      : surface_(surface), reach_(options.radius + 0.5 * kStep), start_(start) {
    const Vector3d way = goal - start;
    const bool along_x = std::abs(way.x()) >= std::abs(way.y());
    const Vector3d room = along_x ? Vector3d(options.beyond, options.half_width, 0)
                                  : Vector3d(options.half_width, options.beyond, 0);
    Vector3d low = way.cwiseMin(0) - room;
    Vector3d high = way.cwiseMax(0) + room;
    low.z() = options.lowest - start.z();
    high.z() = options.highest - start.z();
    first_ = (low / kStep).array().ceil().cast<int>();
    size_ = Vector3i((high / kStep).array().floor().cast<int>()) - first_ + Vector3i::Ones();
    end_ = ((goal - start) / kStep).array().round().cast<int>();
    seen_.assign(static_cast<std::size_t>(size_.prod()), false);
  }

  bool run() {
    offer(Vector3i::Zero());
    while (!open_.empty()) {
      const Vector3i cell = cell_of(open_.top().second);
      if (cell == end_) return true;
      open_.pop();
      for (int axis = 0; axis < 3; ++axis) {
        for (const int way : {-1, 1}) offer(cell + way * Vector3i::Unit(axis));
      }
    }
    return false;
  }

 private:
  void offer(const Vector3i& cell) {
    const Vector3i at = cell - first_;
    if ((at.array() < 0).any() || (at.array() >= size_.array()).any()) return;
    const int index = (at.z() * size_.y() + at.y()) * size_.x() + at.x();
    if (seen_[static_cast<std::size_t>(index)]) return;
    seen_[static_cast<std::size_t>(index)] = true;
    // A point of an edge is at most half a step from a cell: free there by the radius.
    if (surface_.touches(start_ + kStep * cell.cast<double>(), reach_)) return;
    open_.emplace((cell - end_).cwiseAbs().sum(), index);
  }
  [[nodiscard]] Vector3i cell_of(int index) const {
    return first_ +
           Vector3i(index % size_.x(), index / size_.x() % size_.y(), index / (size_.x() * size_.y()));
  }

  const SurfaceDistance& surface_;
  double reach_;
  Vector3d start_;
  Vector3i first_, size_, end_;
  std::vector<bool> seen_;
  std::priority_queue<std::pair<int, int>, std::vector<std::pair<int, int>>, std::greater<>> open_;
};

}  // namespace

bool is_passable(const SurfaceDistance& surface, const Vector3d& start, const Vector3d& goal,
                 const PassageOptions& options) {
  return PassageSearch(surface, start, goal, options).run();
}

Result<std::optional<OpenWorldScene>> find_open_world(OpenWorldKind kind, std::uint64_t seed, double density,
                                                      const std::filesystem::path& world_file) {
  if (!(density >= least_density && density <= greatest_density))
    return Error{fmt::format("--density: found {}, expected {} to {} per hectare", density, least_density,
                             greatest_density)};
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const OpenWorld made = generate_open_world(kind, seed, density, attempt);
    const std::filesystem::path file =
        attempt == 0
            ? world_file
            : world_file.parent_path() / fmt::format("attempt-{}", attempt + 1) / world_file.filename();
    if (const Status s = write_world(made.files, file); !s) return s.error();
    auto world = read_sdf(file);
    if (!world) return world.error();
    auto scene = Scene::build(std::move(world).value());
    if (!scene) return scene.error();
    auto surface = SurfaceDistance::build(*scene);
    if (!surface) return surface.error();
    if (is_passable(*surface, made.start, made.goal)) {
      OpenWorldScene found{
          std::move(scene).value(), std::move(surface).value(), made.start, made.goal, attempt, file};
      return std::optional(std::move(found));
    }
  }
  return std::optional<OpenWorldScene>();
}

Result<OpenWorldScene> make_open_world(OpenWorldKind kind, std::uint64_t seed, double density,
                                       const std::filesystem::path& world_file) {
  auto found = find_open_world(kind, seed, density, world_file);
  if (!found) return found.error();
  if (*found) return std::move(**found);
  return Error{fmt::format(
      "--random {} --seed {} --density {}: found no way for a ball of 0.5 m through {} worlds of this seed, "
      "expected one (fewer obstacles, or another seed)",
      to_name(kind), seed, density, kAttempts)};
}

}  // namespace pade::simulation
