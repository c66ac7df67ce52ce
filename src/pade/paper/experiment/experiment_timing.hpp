// How long the stages of the pipeline take: Table 2 of the paper, and time against the window's size.
#pragma once

#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/paper/experiment/experiment_plan.hpp"

namespace pade::experiment {

/// Jobs that measure time: for table 2 every flow and depth method on each sequence, for the windows every
/// size on one sequence ("forward", else the first).
std::vector<Job> timing_plan(const PlanOptions& options, const std::vector<std::string>& sequences);

/// Milliseconds per frame on the calling thread, medians over a few pairs of frames.
struct JobTimes {
  double derotate = 0;  ///< of the image; 0 where the flow is derotated
  double flow = 0;
  std::map<std::string, double> depth;  ///< by cell
  std::optional<double> map;            ///< the map's update with the depth of the last cell
};

/// Measures a job of timing_plan().
Result<JobTimes> measure_times(const Job& job, const io::Sequence& sequence,
                               const std::function<bool()>& go_on);

std::string to_json(const JobTimes& times);
Result<JobTimes> job_times_from_json(std::string_view text, std::string_view file);

}  // namespace pade::experiment
