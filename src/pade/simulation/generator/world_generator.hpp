// Worlds by seed: the five kinds that the program ships, and any number of others like them.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <utility>

#include "pade/core/options.hpp"
#include "pade/core/result.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/simulation/generator/sdf_builder.hpp"

namespace pade::simulation {

enum class WorldKind { building, street, forest, rubble, corridor };

/// The same files for the same seed, on every machine. Each kind keeps its flight lane free for every seed:
/// - building: a house with a tower on a lawn (the paper's Figure 4), facades at x = 26 m and 27 m; free
/// along y = 3 m,
///   before the lamps at x = 22.9 m, and along the line from (4, 16.5) to (18, 2)
/// - street: a road along x between houses; free within 1.4 m of the centre line (turned signs reach that
/// far,
///   all else stays 1.6 m away)
/// - forest: trees about a row of trunks on the x axis, 7 m apart, to be flown around
/// - rubble: a half-collapsed hall along x with thin poles and wires; free within 0.9 m of y = 0 from 1.2 m
/// to 2.6 m
/// - corridor: 4.4 m wide and 3.3 m high along x, windows on the left; free within 0.75 m of the centre line
WorldFiles generate_world(WorldKind kind, std::uint64_t seed);

/// The same world with meshes of other names, which begin with that of `world_file`: worlds of other files in
/// one folder keep their own.
WorldFiles with_own_meshes(const WorldFiles& files, const std::filesystem::path& world_file);

/// Writes the world file and its meshes (into meshes/ beside it). Existing files are replaced, or with
/// Overwrite::refuse nothing is written where one of them exists with another content.
Status write_world(const WorldFiles& files, const std::filesystem::path& world_file,
                   io::Overwrite overwrite = io::Overwrite::replace);

}  // namespace pade::simulation

template <>
struct pade::EnumNames<pade::simulation::WorldKind> {
  using K = pade::simulation::WorldKind;
  static constexpr std::array names = {
      std::pair{K::building, std::string_view("building")}, std::pair{K::street, std::string_view("street")},
      std::pair{K::forest, std::string_view("forest")}, std::pair{K::rubble, std::string_view("rubble")},
      std::pair{K::corridor, std::string_view("corridor")}};
};
