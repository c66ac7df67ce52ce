// Reads the folder of a run back.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <opencv2/core.hpp>

#include "pade/core/depth_image.hpp"
#include "pade/core/result.hpp"
#include "pade/core/time.hpp"
#include "pade/io/run/run_info.hpp"

namespace pade::io {

/// A run on disk.
struct Run {
  std::filesystem::path folder;
  RunInfo info;
  RunTiming timing;               ///< without stages if timing.json is missing
  std::vector<Time> depth_times;  ///< of the depth stack, ascending; empty if it was not saved

  [[nodiscard]] bool has(std::string_view file) const { return std::filesystem::exists(folder / file); }
};

/// Refused: a folder without run.json, and a run.json or timing.json that is not as pade writes it.
Result<Run> read_run(const std::filesystem::path& folder);

/// The depth image of one time of the stack, at full size (window 1): depth, variance where the sigma stack
/// was saved (else all NaN), states where the state stack was saved (else measured or out_of_view), the bound
/// where it was saved (else empty). The values are those of the run up to half a count of the stack's scale,
/// bounds up to one count less.
Result<DepthImage> read_depth_image(const Run& run, Time time);

}  // namespace pade::io
