// Figure 4 of the paper: what the pipeline makes of a flight toward a building, at several moments.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/paper/experiment/experiment_plan.hpp"

namespace pade::experiment {

/// The job of figure 4 if it is asked for: the sequence "approach", else the first.
std::optional<Job> flight_job(const PlanOptions& options, const std::vector<std::string>& sequences);

/// Maps the whole sequence and gives JSON with a picture of image, flow, depth and map at each moment, as
/// data: URIs and SVG, and with their scales.
Result<std::string> run_flight(const Job& job, const io::Sequence& sequence,
                               const std::function<bool()>& go_on);

/// Refuses what run_flight did not write. `file` is named in the error.
Status check_flight(std::string_view text, std::string_view file);

}  // namespace pade::experiment
