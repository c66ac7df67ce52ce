// One job of the experiments: a sequence, one flow method, and all depth methods that read that flow. Jobs
// know nothing of each other, so that threads, processes and machines can share them out
// (docs/experiments.md).
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/evaluation/depth_accuracy.hpp"
#include "pade/evaluation/range_means.hpp"
#include "pade/io/sequence/sequence.hpp"
#include "pade/paper/misreadings.hpp"
#include "pade/paper/motion_noise.hpp"
#include "pade/pipeline/obstacle_mapper.hpp"

namespace pade::experiment {

/// One way to get depth from the flow of a job.
struct DepthCell {
  std::string name;  ///< of the row in the tables: "ttc", "pade-literal", ...
  depth::DepthOptions depth;
  Misreading misreading = Misreading::none;
  evaluation::Measured measured = evaluation::Measured::motion;  ///< what noise reaches
  std::string rival;  ///< name of another cell of the job: both are compared where both have an answer
};

/// What a job is made of. All of it, the sequence's content and the program's version make its key.
struct Job {
  std::string table;     ///< that it was made for
  std::string sequence;  ///< name
  std::string flow;
  std::string chain;  ///< method of chain_methods() that makes the depth of both cells; empty = as follows
  depth::Derotation derotation = depth::Derotation::flow;
  Order order = Order::first;
  int step = 1;
  double range = 20;  ///< estimates beyond count as no depth, m
  int grid = 1;       ///< every grid-th pixel and row is compared with the truth
  evaluation::MotionNoise noise;
  int draws = 1;              ///< of the noise
  std::uint64_t seed = 1;     ///< of the noise
  double bound_sigma = 0;     ///< px; above 0 the Cramer-Rao bound for this flow noise is computed as well
  std::string flow_error_of;  ///< an exact cell without windows whose flow is judged as well; empty = none
  std::vector<DepthCell> cells;
};

/// What one cell found on one sequence.
struct CellResult {
  std::string name;
  evaluation::DepthAccuracy accuracy;         ///< all draws pooled
  std::vector<evaluation::RangeMeans> draws;  ///< of each draw of the noise (one where there is none)
  std::vector<evaluation::RangeMeans>
      together;  ///< the same where the rival has an answer; empty without one
};

/// The flow behind a depth where that depth has an answer: errors along the epipolar line, the only ones that
/// reach depth. The "errors" of these means are the quantities themselves.
struct FlowError {
  evaluation::RangeMeans parallax;       ///< true length of the derotated flow, px
  evaluation::RangeMeans error;          ///< |length found - true length|, px
  evaluation::RangeMeans metres_per_px;  ///< the Cramer-Rao bound of depth for a flow error of 1 px, m
};

struct JobResult {
  std::vector<CellResult> cells;                ///< in the order of Job::cells
  std::optional<evaluation::RangeMeans> bound;  ///< mean |error| of the best unbiased estimate
  std::optional<FlowError> flow_error;          ///< of Job::flow_error_of

  [[nodiscard]] const CellResult* cell(std::string_view name) const;
};

/// Content of the job's file: the job itself and what it found.
std::string to_json(const Job& job);
std::string to_json(const JobResult& result);
Result<JobResult> job_result_from_json(std::string_view text, std::string_view file);

/// Name of the job's file without ".json": readable, and with the key in it.
/// @param fingerprint  of the sequence's content.
std::string job_name(const Job& job, std::string_view fingerprint);

/// Does the job. `go_on` is asked after each frame; false leaves with io::interrupted_and_kept_error().
Result<JobResult> run_job(const Job& job, const io::Sequence& sequence, const std::function<bool()>& go_on);

}  // namespace pade::experiment
