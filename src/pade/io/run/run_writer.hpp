// Writes the folder of a run (docs/design.md, "Files that people meet"): whole or not at all.
#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "pade/core/camera.hpp"
#include "pade/core/depth_image.hpp"
#include "pade/core/flow_field.hpp"
#include "pade/core/pose.hpp"
#include "pade/core/result.hpp"
#include "pade/io/atomic_output.hpp"
#include "pade/io/run/run_info.hpp"

namespace pade::io {

/// The image stacks that are written on request only.
struct ImageStacks {
  bool depth = false, sigma = false, state = false, bound = false, flow = false;

  /// Reads "depth,sigma,state,bound,flow" (any of them, in any order; empty = none).
  static Result<ImageStacks> parse(std::string_view names);
};

struct RunWriterOptions {
  Overwrite overwrite = Overwrite::refuse;
  ImageStacks save;
  cv::Size image_size;     ///< of the undistorted frames; depth images with window n > 1 are grown to it
  double range_limit = 0;  ///< metres; decides the scale of depth, sigma and bound images. 0 = none
};

/// One run under way. What it writes appears at its place with finish(); destroyed before that, it leaves
/// nothing.
class RunWriter {
 public:
  /// The name of the file that tells a run from any other folder.
  static constexpr std::string_view run_file = "run.json";

  /// Refuses an existing folder (without overwrite) and one that cannot be written, before any work is done.
  static Result<RunWriter> create(const std::filesystem::path& folder, const RunWriterOptions& options);

  /// Writes the image stacks asked for and counts the states. `flow` may be empty. Refused: a bound asked for
  /// of a depth image that has none.
  Status add(const DepthImage& depth, const FlowField& flow = {});
  /// One row of trajectory.txt (TUM: t x y z qx qy qz qw, camera to world).
  void add_pose(Time time, const Pose& T_world_camera);

  /// A file of the run with this content, a text or a ByteSource: evaluation.json, cloud.ply ...
  template <class Content>
  Status write(const std::filesystem::path& name, const Content& content) {
    return output_.write(name, content);
  }
  /// Where a writer that takes a path puts a file of the run now: cloud.ply, map.bt, map.ot ...
  Result<std::filesystem::path> place(const std::filesystem::path& name) const { return output_.place(name); }
  /// Where the run will be.
  [[nodiscard]] const std::filesystem::path& folder() const { return output_.target(); }

  /// `info` with the fields that the writer knows: scales, stacks, counts of states.
  [[nodiscard]] RunInfo completed(RunInfo info) const;

  /// Writes trajectory.txt, run.json and, as the last of all, timing.json with what `timing` says then; moves
  /// the folder to its place.
  Status finish(const RunInfo& info, const std::function<RunTiming()>& timing);

 private:
  RunWriter(OutputFolder output, const RunWriterOptions& options);

  OutputFolder output_;
  RunWriterOptions options_;
  double scale_ = 0;  // counts per metre
  std::string trajectory_ = "# timestamp tx ty tz qx qy qz qw   (camera to world, metres)\n";
  std::array<std::uint64_t, depth_state_names.size()> state_pixels_ = {};
};

}  // namespace pade::io
