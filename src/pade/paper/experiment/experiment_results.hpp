// The finished jobs of an experiment, read back and put in order.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/paper/experiment/experiment_run.hpp"
#include "pade/paper/experiment/experiment_timing.hpp"

namespace pade::experiment {

struct DoneJob {
  Job job;
  JobResult result;
};

struct DoneTiming {
  Job job;
  JobTimes times;
};

/// What one method found on one sequence.
struct SequenceCell {
  std::string sequence;
  const CellResult* cell = nullptr;
};

struct Results {
  PlanOptions options;
  std::vector<std::string> sequences;
  std::vector<DoneJob> jobs;       ///< in the order of the plan
  std::vector<DoneTiming> timing;  ///< likewise
  std::string flight;              ///< JSON of figure 4, empty if it was not asked for

  /// Of each sequence the cell `name` of the jobs that match. `flow` empty = any.
  [[nodiscard]] std::vector<SequenceCell> cells(std::string_view table, std::string_view flow,
                                                std::string_view name,
                                                const evaluation::MotionNoise& noise = {}) const;
  [[nodiscard]] bool has(std::string_view table) const;
};

/// Reads all finished jobs. Refused if some are not finished: the message says how many, and which is
/// first.
Result<Results> read_results(const Experiment& experiment, const Store& store);

/// The mean over the sequences of the figures of a range; over the pixels of a sequence they are pooled.
evaluation::DepthAccuracy mean_over(const std::vector<SequenceCell>& cells);

}  // namespace pade::experiment
