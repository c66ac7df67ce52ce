// What a reader passed over and why: the entries of the health report.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pade/core/health.hpp"

namespace pade::io {

/// What a reader had to say beside its result.
struct ReadReport {
  std::vector<Skipped> skipped;
  std::vector<std::string> notes;  ///< used, but worth knowing: rows that had to be sorted, unknown fields

  void skip(std::string file, std::string reason) { skipped.push_back({std::move(file), std::move(reason)}); }
};

}  // namespace pade::io
