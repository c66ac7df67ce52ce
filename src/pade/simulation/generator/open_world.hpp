// Worlds without lanes, to be found through: things stand anywhere between a free start and a free goal, as
// many per hectare as one asks for.
#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <utility>

#include <Eigen/Core>

#include "pade/core/options.hpp"
#include "pade/simulation/generator/sdf_builder.hpp"

namespace pade::simulation {

enum class OpenWorldKind { forest, rubble, building_site, street };

/// A world and a task in it.
struct OpenWorld {
  WorldFiles files;
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< nothing stands within 2.5 m of it, m
  Eigen::Vector3d goal =
      Eigen::Vector3d::Zero();  ///< nothing stands within 2 m of it; 60 m east of the start, m
};

/// The least and the greatest density that is made, things per hectare.
inline constexpr double least_density = 10;
inline constexpr double greatest_density = 2000;

/// The same files for the same numbers, on every machine. Obstacles lie anywhere in 84 m x 50 m about the
/// straight way:
/// - forest: trees, and in addition a shrub for every four and a leaning dead trunk for every sixteen
/// - rubble: pillars, slabs, poles and stones over ground covered with rubble, wires above
/// - building_site: columns, walls, scaffolds, stacks, containers, cables
/// - street: cars, poles, trees, signs, bins between houses 18 m apart, wires across
/// @param density  obstacles per hectare
/// @param attempt  another world of the same seed, for where nothing gets through the first
OpenWorld generate_open_world(OpenWorldKind kind, std::uint64_t seed, double density, int attempt = 0);

}  // namespace pade::simulation

template <>
struct pade::EnumNames<pade::simulation::OpenWorldKind> {
  using K = pade::simulation::OpenWorldKind;
  static constexpr std::array names = {std::pair{K::forest, std::string_view("forest")},
                                       std::pair{K::rubble, std::string_view("rubble")},
                                       std::pair{K::building_site, std::string_view("building-site")},
                                       std::pair{K::street, std::string_view("street")}};
};
