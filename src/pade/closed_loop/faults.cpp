#include "pade/closed_loop/faults.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>

#include "pade/closed_loop/navigated_vehicle.hpp"
#include "pade/core/option_check.hpp"

namespace pade::closed_loop {
namespace {

using Eigen::Vector3d;
using simulation::Box;
using simulation::is_passable;
using simulation::OpenWorldScene;
using simulation::Scene;
using simulation::SurfaceDistance;
using simulation::Visual;
using simulation::World;
constexpr double kDegree = std::numbers::pi / 180;

/// Along the ground from start to goal.
Vector3d heading(const OpenWorldScene& world) {
  const Vector3d way = world.goal - world.start;
  return Vector3d(way.x(), way.y(), 0).normalized();
}

Result<OpenWorldScene> rebuilt(World world, const OpenWorldScene& as) {
  auto scene = Scene::build(std::move(world));
  if (!scene) return scene.error();
  auto surface = SurfaceDistance::build(*scene);
  if (!surface) return surface.error();
  return OpenWorldScene{std::move(scene).value(), std::move(surface).value(), as.start, as.goal, as.attempt};
}

Result<OpenWorldScene> with_low_sun(const OpenWorldScene& as) {
  constexpr double kHeight = 10 * kDegree;
  World world = as.scene.world();
  const Vector3d to_sun = std::cos(kHeight) * heading(as) + std::sin(kHeight) * Vector3d::UnitZ();
  if (!world.sun) world.sun.emplace();
  world.sun->direction = -to_sun;
  world.sun->colour = Vector3d(0.8, 0.6, 0.4);  // what the long way through the air leaves
  return rebuilt(std::move(world), as);
}

/// As far ahead as leaves a way around it.
Result<OpenWorldScene> with_blank_wall(const OpenWorldScene& as) {
  constexpr std::array kAhead = {12.0, 10.0, 14.0, 8.0, 16.0};  // m
  const Vector3d along = heading(as);
  for (const double ahead : kAhead) {
    World world = as.scene.world();
    Visual wall;
    wall.name = "blank wall";
    wall.shape = Box{{0.2, 6, 4}};
    wall.material.colour = Vector3d::Constant(0.5);
    const Vector3d foot = as.start + ahead * along;
    wall.T_world_shape = {
        Eigen::Quaterniond(Eigen::AngleAxisd(std::atan2(along.y(), along.x()), Vector3d::UnitZ())),
        {foot.x(), foot.y(), 2}};
    world.visuals.push_back(wall);
    auto built = rebuilt(std::move(world), as);
    if (!built) return built.error();
    if (is_passable(built->surface, built->start, built->goal)) return built;
  }
  return Error{
      "--fault blank-wall: found no way around a wall 6 m wide, 8 to 16 m ahead, expected one (another "
      "seed)"};
}

/// A number in [0, 1) for each frame of a seed (the finaliser of SplitMix64).
double chance(std::uint64_t seed, int frame) {
  std::uint64_t z = seed * 0x9e3779b97f4a7c15U + static_cast<std::uint64_t>(frame) + 0x632be59bd9b4e019U;
  for (const std::uint64_t factor : {0xbf58476d1ce4e5b9U, 0x94d049bb133111ebU}) z = (z ^ (z >> 29)) * factor;
  return static_cast<double>((z ^ (z >> 32)) >> 11) * 0x1p-53;
}

}  // namespace

Status check(const FaultOptions& options) {
  const std::array<OptionRange, 7> ranges = {
      {{"from", options.from, 0, 1e5},
       {"duration", options.duration, 0, 1e5},
       {"stamp_error", options.stamp_error, 0, NavigatedVehicle::remembered},
       {"gust", options.gust, -50, 50},
       {"compass_error", options.compass_error, -std::numbers::pi, std::numbers::pi},
       {"crossing_ahead", options.crossing_ahead, 0, 1e3},
       {"crossing_at", options.crossing_at, 0, 1e5}}};
  return check_ranges(ranges);
}

bool is_dropped(std::uint64_t seed, int frame) {
  // Runs of one, two or three frames begin at random: together one frame in ten.
  constexpr std::array kRuns = {0.075, 0.0205, 0.0065};  // that one of at least that length begins
  for (int before = 0; before < static_cast<int>(kRuns.size()); ++before) {
    if (frame >= before && chance(seed, frame - before) < kRuns[static_cast<std::size_t>(before)])
      return true;
  }
  return false;
}

FaultOptions::Seconds FaultOptions::seconds_of(double flight) const {
  constexpr double kPassing = 4;  // s that somebody is in the way
  const auto between = [&](double begin, double end) -> Seconds {
    return {std::clamp(flight - begin, 0.0, end - begin), std::max(flight - end, 0.0)};
  };
  switch (kind) {
    case Fault::none:
      return {0, 0};
    case Fault::gnss_outage:
    case Fault::frozen_camera:
    case Fault::gust:
      return between(from, from + duration);
    case Fault::crossing:
      return between(crossing_at - kPassing / 2, crossing_at + kPassing / 2);
    default:
      return {flight, 0};
  }
}

Result<OpenWorldScene> built_for(Fault fault, OpenWorldScene world) {
  if (fault == Fault::low_sun) return with_low_sun(world);
  if (fault == Fault::blank_wall) return with_blank_wall(world);
  return world;
}

}  // namespace pade::closed_loop
