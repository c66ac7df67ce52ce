// The plots of the experiments from finished jobs.
#pragma once

#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/paper/tables/experiment_tables.hpp"

namespace pade::experiment {

/// <svg> elements.
using Plots = std::vector<std::string>;

/// The paper's Figure 3: error by range, with and without noise of the largest level; one plot per noise
/// model.
Result<Plots> figure3_by_range(const Results& results);
/// Error against the level of the noise; one plot per noise model and range.
Result<Plots> figure3_by_level(const Results& results);
/// Error against n; one plot per range.
Result<Plots> windows_plots(const Results& results);
/// Error by range of every flow, literal and exact.
Result<Plots> table1_plots(const Results& results);

}  // namespace pade::experiment
