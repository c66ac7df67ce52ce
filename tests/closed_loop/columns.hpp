// A small world to fly in: columns on a plain.
#pragma once

#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "pade/simulation/render/scene.hpp"
#include "pade/simulation/render/surface_distance.hpp"

namespace pade::closed_loop {

struct Place {
  simulation::Scene scene;
  simulation::SurfaceDistance surface;
};

inline Place built(simulation::World world) {
  auto scene = simulation::Scene::build(std::move(world));
  EXPECT_TRUE(scene.ok());
  auto surface = simulation::SurfaceDistance::build(*scene);
  EXPECT_TRUE(surface.ok());
  return {std::move(scene).value(), std::move(surface).value()};
}

inline constexpr double column_radius = 0.3;  // m

/// Columns 4 m tall, of gravel like the ground, under a blank sky.
/// @param at  their axes, m
inline Place columns(const std::vector<Eigen::Vector2d>& at) {
  using simulation::Cylinder;
  using simulation::Material;
  using simulation::PatternKind;
  using simulation::Rectangle;
  using simulation::World;
  World world;
  Material stone;
  stone.pattern.kind = PatternKind::gravel;
  world.visuals.push_back({"ground", {}, Rectangle{Eigen::Vector3d::UnitZ(), {200, 200}}, stone, true});
  for (const auto& p : at)
    world.visuals.push_back({"column",
                             {Eigen::Quaterniond::Identity(), {p.x(), p.y(), 2}},
                             Cylinder{column_radius, 4},
                             stone,
                             true});
  return built(std::move(world));
}

}  // namespace pade::closed_loop
