// `pade experiment fly`: the grid of docs/fly.md, worlds x seeds x configurations x faults.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "pade/core/result.hpp"

namespace pade::cli {

struct GridOptions {
  /// Of grid_configurations(), or `all`; empty: what the table of docs/fly.md begins with.
  std::vector<std::string> configurations;
  std::filesystem::path out;
  int threads = 1;
  int shard = 1;  ///< of `shards`, counted from 1: flies every shards-th flight
  int shards = 1;
  bool quick = false;  ///< six flights of 20 m
  bool force = false;
  bool json = false;
};

/// chain, exact, straight; what they can be compared with; densities; the faults.
std::vector<std::string> grid_configurations();

/// Flies what is missing and prints the table. What an earlier run, or another shard with the same folder,
/// has finished is kept. The table, `grid.json` and a report per configuration and world are written once all
/// flights are there.
Status fly_grid(const GridOptions& options);

}  // namespace pade::cli
