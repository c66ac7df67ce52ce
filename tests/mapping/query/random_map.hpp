// Maps at random: balls of free and of occupied voxels, some of them in large cubes.
#pragma once

#include <memory>
#include <random>
#include <utility>

#include <octomap/OcTree.h>

#include "pade/mapping/occupancy_map.hpp"

namespace pade::mapping {

/// Half of the space within 4 m of the origin is free, with obstacles in it; the rest is unknown.
inline OccupancyMap random_map(std::uint64_t seed, double voxel = 0.1, int obstacles = 40) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-4, 4);
  std::uniform_real_distribution<double> size(0.1, 1);
  auto tree = std::make_unique<octomap::OcTree>(voxel);
  const auto ball = [&](double x, double y, double z, double radius, float log_odds) {
    for (double dx = -radius; dx <= radius; dx += voxel)
      for (double dy = -radius; dy <= radius; dy += voxel)
        for (double dz = -radius; dz <= radius; dz += voxel)
          if (dx * dx + dy * dy + dz * dz <= radius * radius)
            tree->setNodeValue(x + dx, y + dy, z + dz, log_odds, true);
  };
  for (int i = 0; i < 25; ++i) {
    const double x = place(random);
    const double y = place(random);
    ball(x, y, 0.3 * place(random), 0.5 + size(random), i % 3 == 0 ? -2.0F : -0.4F);
  }
  for (int i = 0; i < obstacles; ++i) {
    const double x = place(random);
    const double y = place(random);
    ball(x, y, 0.3 * place(random), 0.4 * size(random), i % 3 == 0 ? 3.4F : 0.8F);
  }
  tree->updateInnerOccupancy();
  tree->prune();
  return std::move(OccupancyMap::create({}, std::move(tree))).value();
}

}  // namespace pade::mapping
