// What the parts of a session that speak DDS have in common: the clock of stamps, the names of frames, and
// why there is no image.
#pragma once

#include <mutex>
#include <string>

#include "pade/io/recording/flight/flight_names.hpp"
#include "pade/live/dds/dds_options.hpp"
#include "pade/live/dds/message_clock.hpp"
#include "pade/live/shared_text.hpp"

namespace pade::live {

/// Names of the frames of messages.
struct Frames {
  std::string world, body, camera;
  std::string map;  ///< of the map, where it has an origin of its own in the world of the poses
};

/// What frames are called: as messages that come call them, else by our own names. Any thread.
class FrameNames {
 public:
  explicit FrameNames(const DdsOptions& options) {
    const std::string before = options.name_space.empty() ? std::string() : options.name_space + "/";
    frames_ = {before + io::flight_names::world_frame, before + io::flight_names::body_frame,
               before + io::flight_names::camera_frame, before + "pade_map"};
  }
  /// @{
  /// An empty name changes nothing.
  void set_world(const std::string& name) { set(frames_.world, name); }
  void set_body(const std::string& name) { set(frames_.body, name); }
  void set_camera(const std::string& name) { set(frames_.camera, name); }
  /// @}
  [[nodiscard]] Frames now() const {
    const std::lock_guard lock(mutex_);
    return frames_;
  }

 private:
  void set(std::string& frame, const std::string& name) {
    const std::lock_guard lock(mutex_);
    if (!name.empty()) frame = name;
  }
  mutable std::mutex mutex_;
  Frames frames_;
};

/// Of one session. Any thread.
struct DdsShared {
  explicit DdsShared(const DdsOptions& options, const TimeSources& sources = {})
      : clock(options.clock, sources), names(options) {}
  MessageClock clock;
  FrameNames names;
  SharedText no_image;  ///< why none comes, or which were left out; empty: nothing is wrong
};

}  // namespace pade::live
