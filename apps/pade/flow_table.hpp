// What `pade flow evaluate` prints: a table for people, or the same figures as JSON.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pade/evaluation/flow_accuracy.hpp"

namespace pade::cli {

/// Processor time of one thread.
struct FlowTiming {
  double milliseconds = 0;  ///< median
  double ratio = 0;         ///< to OpenCV's Farneback, medians of the same interleaved runs
};

/// One method on one pair, or on all pairs of a folder.
struct FlowScore {
  std::string pair;
  evaluation::FlowAccuracy accuracy;
  std::optional<evaluation::FlowConfidenceAccuracy> confidence;  ///< empty: the method gave no sigma
};

/// One method on the pairs of one folder.
struct FlowMethodScores {
  std::string method;
  std::vector<FlowScore> pairs;
  FlowTiming timing;
};

struct FlowFolderScores {
  std::string folder;
  std::vector<FlowMethodScores> methods;
};

struct FlowTableOptions {
  bool timed = false;
  bool confident = false;
  bool means_only = false;
};

void print_flow_table(const std::vector<FlowFolderScores>& folders, const FlowTableOptions& options);
void print_flow_json(const std::vector<FlowFolderScores>& folders, const FlowTableOptions& options);

}  // namespace pade::cli
