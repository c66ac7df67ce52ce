// The part of `pade evaluate` that compares maps with the geometry of a simulated world.
#pragma once

#include <string>
#include <vector>

#include "pade/core/result.hpp"

namespace pade::cli {

struct EvaluateMapArguments {
  std::vector<std::string> runs;
  std::string world;
  std::string sequence;  ///< empty: where run.json says
  std::string reference;
  std::vector<std::string> resources;
  bool align = true;
  bool replay = false;
  bool ceiling = true;
  bool json = false;
};

/// Prints the measures of docs/map-evaluation.md for each run.
Status evaluate_maps(const EvaluateMapArguments& arguments);

}  // namespace pade::cli
