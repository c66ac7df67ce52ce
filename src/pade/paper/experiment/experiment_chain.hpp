// Beyond the paper: the jobs that run the whole chain of `pade map` in place of one pair of frames at a time.
#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/paper/experiment/experiment_job.hpp"

namespace pade::experiment {

/// A way from frames and poses to depth, each with one step more than the one before.
struct ChainMethod {
  std::string_view name;     ///< of its cell
  std::string_view meaning;  ///< in words
  bool only_with_noise;      ///< exact poses leave nothing of the step
};
/// From the paper as printed to the default of `pade map`.
const std::vector<ChainMethod>& chain_methods();

/// The mapper of a method. @param name  one of chain_methods()
ObstacleMapperOptions chain_options(std::string_view name, double range);

/// Name of the second cell of a method: its depth divided by one number per frame, the median of depth over
/// truth. What the images can know at all: the common scale comes from GPS/INS alone.
std::string scaled_cell(std::string_view name);

/// The noises that chains are tried with: none, then two levels of each model.
std::vector<evaluation::MotionNoise> chain_noises();

/// Flies the sequence through the mapper that Job::chain names, with noise on each step between frames, and
/// its covariance. `go_on` as in run_job().
Result<JobResult> run_chain_job(const Job& job, const io::Sequence& sequence,
                                const std::function<bool()>& go_on);

}  // namespace pade::experiment
