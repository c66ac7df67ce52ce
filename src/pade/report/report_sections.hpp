// The sections of a run's page that any run has: how long it took, how well it went, and how it was made.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "pade/core/depth_image.hpp"
#include "pade/io/run/run_info.hpp"

namespace pade::evaluation {

/// The states of a pixel with their colours and, if given, their shares of `pixels`.
std::string state_items(const std::array<std::uint64_t, depth_state_names.size()>* pixels);

/// Bars of the stages, frames per second and memory; empty without stages.
std::string timing_section(const io::RunTiming& timing);
/// Frames used and left out, warnings, the states of all pixels.
std::string health_section(const io::RunInfo& info);
/// Sequence, version, every option.
std::string options_section(const io::RunInfo& info);

}  // namespace pade::evaluation
