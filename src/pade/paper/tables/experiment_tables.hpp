// The tables of the experiments from finished jobs.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pade/paper/experiment/experiment_results.hpp"
#include "pade/paper/verdicts/verdicts.hpp"
#include "pade/report/tables/result_table.hpp"

namespace pade::experiment {

/// "pade experiment table1 --quick": the command that makes a table alone from the same sequences.
std::string command_of(const PlanOptions& options, std::string_view table);

/// Accuracy of every flow with every depth method, beside the paper's.
evaluation::ResultTable table1(const Results& results);
/// The flow's error along the epipolar line behind exact PADE, and the depth error that it has to cause.
evaluation::ResultTable flow_errors_table(const Results& results);
/// Which share of the pixels each method answers, by sequence: TTC has no answer without forward motion.
evaluation::ResultTable answers_by_sequence(const Results& results);
/// Accuracy against noise, with the Cramer-Rao bound.
evaluation::ResultTable figure3_table(const Results& results);
/// Accuracy against the size of the window.
evaluation::ResultTable windows_table(const Results& results);
/// The paper's equations put right one after the other.
evaluation::ResultTable errata_table(const Results& results);
/// TTC's error less PADE's, where both answer and on all pixels. `pade` is pade-literal or pade-exact;
/// `source` is table1 (clean motion, all flows) or figure3 (literal alone, with noise).
evaluation::ResultTable comparison_table(const Results& results, std::string_view pade,
                                         std::string_view source);

/// Every cell of every job by sequence and range.
evaluation::DataTable all_cells(const Results& results);

/// Both methods of table 1 side by side: clean motion, all pixels.
std::vector<evaluation::ErrorRow> clean_rows(const Results& results, std::string_view pade);
/// What the verdicts are made of: those, and the noise of figure 3 where it is there.
std::vector<evaluation::ErrorRow> error_rows(const Results& results, std::string_view pade);

/// Means over draws and sequences of figure 3: per range a mean and the spread of the draws.
struct NoisePoint {
  std::array<evaluation::Interval, evaluation::range_count> ranges;
};
NoisePoint noise_point(const Results& results, std::string_view flow, std::string_view cell,
                       const evaluation::MotionNoise& noise);
/// The same of the bound: estimate only.
NoisePoint bound_point(const Results& results, std::string_view flow, const evaluation::MotionNoise& noise);

/// How people read the name of a cell: "PADE literal".
std::string shown_name(std::string_view cell);

}  // namespace pade::experiment
