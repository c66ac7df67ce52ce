// What each table and figure of the experiments is made of: a pure function from options to a list of jobs,
// so that every process that knows the options knows all the work and which part of it is its own.
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "pade/paper/experiment/experiment_job.hpp"

namespace pade::experiment {

/// What can be asked for, in the order of the report. All but the last are the paper's.
inline constexpr std::array<std::string_view, 7> table_names = {"table1",  "table2", "figure3", "figure4",
                                                                "windows", "errata", "beyond"};

/// The rows of the tables: how depth is read from flow.
inline constexpr std::string_view ttc = "ttc";                    ///< time to collision, like the next
inline constexpr std::string_view pade_literal = "pade-literal";  ///< the paper as printed (as_printed())
inline constexpr std::string_view pade_exact = "pade-exact";      ///< our defaults, gates off
inline constexpr std::string_view ttc_velocity = "ttc-velocity";  ///< ttc with noise on its speed alone
inline constexpr std::string_view ttc_exact = "ttc-exact";        ///< time to collision, like the one before

struct PlanOptions {
  std::string tables = "table1,table2,figure3,figure4,windows,errata";  ///< comma-separated
  std::string flows;    ///< comma-separated; empty = those of each table
  std::string source;   ///< the words of the command line that chose the sequences
  std::string flights;  ///< how flights in a closed loop ended, as evaluation::flights_from_text() reads it
  int step = 1;
  double range = 20;
  int draws = 10;
  int seed = 1;
  double bound_sigma = 0.1;

  template <class Self, class Visitor>
  static void visit(Self& self, Visitor&& field) {
    field("tables", self.tables, "what is made");
    field("flows", self.flows, "optical-flow methods; empty = those of each table");
    field("source", self.source, "options that chose the sequences");
    field("flights", self.flights, "how flights in a closed loop ended: name:flights:arrived:collided, ...");
    field("step", self.step, "pairs each frame with the step-th before it");
    field("range", self.range, "farther depth counts as none, m");
    field("draws", self.draws, "of the noise of figure 3");
    field("seed", self.seed, "of the noise of figure 3");
    field("bound_sigma", self.bound_sigma, "flow noise of the Cramer-Rao bound, px per component");
  }
};

/// The words of a comma-separated list.
std::vector<std::string> words(std::string_view list);

/// The flow methods of a table: options.flows or its own.
std::vector<std::string> flows_of(const PlanOptions& options, std::string_view table);

/// Further flows of figure 3, only without noise and with the largest multiplicative noise.
std::vector<std::string> other_noisy_flows(const PlanOptions& options);

inline constexpr std::array<int, 5> window_sizes = {1, 2, 4, 8, 16};
inline constexpr std::array<double, 5> noise_levels = {0, 0.05, 0.10, 0.15, 0.20};
/// No noise, then every level of either model.
std::vector<evaluation::MotionNoise> all_noises();

/// A row of the table of errata: its name, what is switched, and which job's cell it is.
struct ErratumRow {
  std::string_view name;     ///< of the cell
  std::string_view meaning;  ///< in words
};
const std::vector<ErratumRow>& errata_rows();

/// The jobs of tables that compare depth with truth, over the named sequences. Nothing for table2 and
/// figure4.
std::vector<Job> plan(const PlanOptions& options, const std::vector<std::string>& sequences);

/// The depth options of a named method, and how flow has to be computed for it.
struct MethodOptions {
  depth::DepthOptions depth;
  depth::Derotation derotation = depth::Derotation::flow;
  Order order = Order::first;
};
MethodOptions method_options(std::string_view method, double range);

}  // namespace pade::experiment
