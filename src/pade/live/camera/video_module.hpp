// What the program and its module for videos (libav_module.cpp) agree on.
#pragma once

#include <memory>
#include <string>
#include <string_view>

#include <opencv2/core.hpp>

#include "pade/core/time.hpp"
#include "pade/core/version.hpp"

namespace pade::live {

/// An image of a video.
struct VideoFrame {
  cv::Mat image;  ///< CV_8UC1 or CV_8UC3 (BGR), its own, turned as the video says
  double seconds =
      0;         ///< when it is to be shown, by the video's own clock; of a stream without one: `arrived`
  Time arrived;  ///< its last byte, by our clock
};

/// A file or a stream while it is open. None of its functions throws.
class Video {
 public:
  /// What became of a question for the next frame.
  enum class Read : unsigned char {
    frame,     ///< here it is
    unusable,  ///< one came that is damaged or has no stamp
    ended,     ///< none will come any more
    failed,    ///< nothing came in time, the connection is gone, or a turn that none can make: see why()
  };
  Video() = default;
  Video(const Video&) = delete;
  Video& operator=(const Video&) = delete;
  virtual ~Video() = default;

  /// Waits for the next frame, of a stream at most as long as it was opened for.
  virtual Read next(VideoFrame& frame) = 0;
  [[nodiscard]] virtual std::string why() const = 0;
};

/// Where a video is, and how it is waited for.
struct VideoPlace {
  std::string name;             ///< of a file, or an address such as rtsp://192.168.0.10/main
  bool stream = false;          ///< an address
  double patience = 1;          ///< of a stream: so long without a byte, and it has failed, s
  bool (*stop)(const void*){};  ///< asked while it waits, with `asker`; true: give up
  const void* asker = nullptr;
};

/// The module's functions; none of them throws.
struct VideoModule {
  /// Of the build. A cv::Mat is what both sides take it for only if they agree.
  std::string_view pade = version, opencv = CV_VERSION;
  /// Null where it cannot be opened; then `why` says it.
  std::unique_ptr<Video> (*open)(const VideoPlace& place, std::string& why) = nullptr;
};

/// The module's one symbol.
inline constexpr const char* video_module_symbol = "pade_video_module";

}  // namespace pade::live
