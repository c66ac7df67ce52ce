// A video file into a folder of images.
#pragma once

#include <filesystem>
#include <string>

#include "pade/core/result.hpp"
#include "pade/core/time.hpp"

namespace pade::cli {

/// Whether `pade convert` takes it for a video: by its ending.
bool is_video(const std::filesystem::path& file);

/// What becomes of a video.
struct VideoConversion {
  std::string in, out;
  std::string calibration;  ///< file that becomes camera.yaml
  int camera = 0;           ///< of a calibration that holds several
  Time start;               ///< of the first frame
  bool force = false;
};

/// Writes the frames as PNG in the TUM layout (docs/sequences.md), named by their times, with the calibration
/// and without poses; says on the terminal what became of how many. Errors: no video, no module for videos,
/// another size than the calibration's, a calibration that camera.yaml cannot hold, what cannot be written.
Status convert_video(const VideoConversion& conversion);

}  // namespace pade::cli
