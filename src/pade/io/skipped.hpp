// What a reader passed over and why: the entries of the health report.
#pragma once

#include <string>
#include <vector>

namespace pade::io {

/// One piece of input that could not be used although the rest can (docs/sequences.md: skipped, not refused).
struct Skipped {
  std::string file;    ///< path as read, or relative to the sequence if it lies inside
  std::string reason;  ///< line or field, what was found, what was expected

  bool operator==(const Skipped&) const = default;
};

/// What a reader had to say beside its result.
struct ReadReport {
  std::vector<Skipped> skipped;
  std::vector<std::string> notes;  ///< used, but worth knowing: rows that had to be sorted, unknown fields

  void skip(std::string file, std::string reason) { skipped.push_back({std::move(file), std::move(reason)}); }
};

}  // namespace pade::io
