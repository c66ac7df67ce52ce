// The folder of an experiment while it is worked on: finished jobs as small files that appear whole or not at
// all, so that whoever comes back later, or works beside, never does them again.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "pade/core/result.hpp"

namespace pade::experiment {

/// plan.json is there from the start and tells such a folder from others; experiment.json is written last.
inline constexpr std::string_view plan_file = "plan.json";
inline constexpr std::string_view finished_file = "experiment.json";
inline constexpr std::string_view timing_file = "timing.json";

class Store {
 public:
  /// Whether open() would refuse `out` for what is there: for a look before long work.
  static Status check(const std::filesystem::path& out, bool again);
  /// Takes the folder `out` or makes it. Refused: a folder that is neither empty nor an experiment's, a
  /// finished experiment unless `again`, and a place that cannot be written to.
  static Result<Store> open(const std::filesystem::path& out, bool again);
  /// An experiment that is only read. Refused if there is no plan.json.
  static Result<Store> read_only(const std::filesystem::path& folder);

  [[nodiscard]] const std::filesystem::path& folder() const { return folder_; }

  /// Whether the job of this name is finished. Jobs of `timing` live apart, as they are never the same twice:
  /// in timing/, at the end in timing.json.
  [[nodiscard]] bool has(std::string_view job, bool timing) const;
  [[nodiscard]] Result<std::string> read(std::string_view job, bool timing) const;
  /// Safe from several threads and processes.
  [[nodiscard]] Status write(std::string_view job, bool timing, std::string_view content) const;

  /// A file of the experiment, put in place whole.
  [[nodiscard]] Status write_file(std::string_view name, std::string_view content) const;
  /// Replaces timing/ by timing.json, and removes what interrupted writers left.
  [[nodiscard]] Status tidy_up(std::string_view timing_json) const;

 private:
  explicit Store(std::filesystem::path folder) : folder_(std::move(folder)) {}
  [[nodiscard]] std::filesystem::path place(std::string_view job, bool timing) const;

  std::filesystem::path folder_;
  std::string old_timing_;  // "jobs" of an earlier timing.json, a JSON object
};

/// A number for all that a sequence folder holds: names and contents of its files.
Result<std::string> folder_fingerprint(const std::filesystem::path& folder);

}  // namespace pade::experiment
