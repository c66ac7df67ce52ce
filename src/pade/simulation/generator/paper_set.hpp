// The ten sequences of the experiments: 1038 frames as in the paper (Section 3), each isolating a motion,
// each in a world that fits it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pade/simulation/flight/flight.hpp"
#include "pade/simulation/generator/world_generator.hpp"

namespace pade::simulation {

struct PaperSequence {
  std::string name;
  WorldKind world;
  std::uint64_t world_seed;
  Flight flight;
};

/// Nine flights at 2 m/s and 10 frames per second (0.2 m per frame), and one that turns 2 degrees and
/// moves 2.8 cm per frame. `seed` changes every scene; `quick` flies a tenth of the frames along the same
/// paths.
std::vector<PaperSequence> paper_sequences(std::uint64_t seed, bool quick = false);

}  // namespace pade::simulation
