// Beyond the paper: the table and the plots of the chain, one step after the other.
#pragma once

#include "pade/paper/tables/experiment_plots.hpp"

namespace pade::experiment {

/// Accuracy of each method of chain_methods(), with exact poses and with noise on each step, as it is and
/// after one common scale per frame.
evaluation::ResultTable beyond_table(const Results& results);

/// The paper's Figure 3 with the chain: error by range, without noise and with the largest; one plot per
/// model.
Result<Plots> beyond_plots(const Results& results);

}  // namespace pade::experiment
