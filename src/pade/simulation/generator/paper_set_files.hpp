// The ten sequences of the experiments on the disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/simulation/flight/simulated_sequence.hpp"

namespace pade::simulation {

/// Called after each frame: name of the sequence, frames done and of it all.
using SetProgress = std::function<void(const std::string& label, int done, int total)>;

/// Makes the worlds of paper_sequences(seed, quick) in `folder`/worlds and renders the sequences beside them;
/// finished ones are kept. Gives their folders in the order of the set.
Result<std::vector<std::filesystem::path>> write_paper_set(const std::filesystem::path& folder,
                                                           std::uint64_t seed, bool quick,
                                                           SequenceOptions options,
                                                           const SetProgress& progress = {});

}  // namespace pade::simulation
