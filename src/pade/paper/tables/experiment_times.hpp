// The tables of times. They differ from run to run, so they stand apart from all others: in timing.json and
// in the last section of the reports.
#pragma once

#include <string>
#include <vector>

#include "pade/paper/experiment/experiment_results.hpp"
#include "pade/paper/verdicts/verdicts.hpp"
#include "pade/report/tables/result_table.hpp"

namespace pade::experiment {

/// Time per stage and frame rate of every combination, beside the paper's.
evaluation::ResultTable table2(const Results& results);
/// Time of the depth step against the size of the window.
evaluation::ResultTable windows_times(const Results& results);
/// What the verdicts on speed are made of.
std::vector<evaluation::TimeRow> time_rows(const Results& results);

/// The machine: processor and number of cores, as far as the system tells.
std::string machine();

}  // namespace pade::experiment
