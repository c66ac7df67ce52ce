// From finished jobs to what people read: tables, plots, verdicts and the report.
#pragma once

#include <string>

#include "pade/core/result.hpp"
#include "pade/paper/experiment/experiment_run.hpp"

namespace pade::experiment {

/// Writes all results of a complete experiment into its folder and gives the tables as text for a terminal.
///   experiment.json, cells.csv       every figure, the options, and the verdicts on accuracy
///   results.md, report.html          the same for people; times are in their last sections
///   figures/                         the plots and pictures as files
///   timing.json                      all times, and the verdicts on speed
/// The same jobs give the same bytes, but for timing.json and those last sections. experiment.json is written
/// last. Refused if jobs are missing.
Result<std::string> finish(const Experiment& experiment, const Store& store);

}  // namespace pade::experiment
