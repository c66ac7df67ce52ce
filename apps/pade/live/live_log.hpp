// What `pade live` says while it runs and at its end.
#pragma once

#include <cstddef>
#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "pade/live/camera/folder_source.hpp"
#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/link/health.hpp"
#include "pade/live/map_saver.hpp"
#include "pade/live/recordings/session_recorder.hpp"
#include "pade/live/session.hpp"

namespace pade::cli {

/// On standard error. A log that cannot be written (its disk is full, the terminal has gone, nobody reads the
/// pipe) costs the log, not the flight: lines that would have to wait are left out, and that is said once
/// there is room.
void say(const std::string& text);

/// Where the map's origin is.
std::string origin_text(const live::Session& session);

/// A line each five seconds, for the log, and what happens between them.
class LiveLog {
 public:
  /// @param others  what else there is to say: of the page's clients, of topics
  void maybe(const live::Progress& progress, const live::LinkReport& link, const live::Session& session,
             const std::function<std::vector<std::string>()>& others);

 private:
  Time last_ = live::now_of_ours();
  std::size_t restarts_ = 0, borders_ = 0;
  Eigen::Vector3d origin_ = Eigen::Vector3d::Zero();
};

/// What is wrong with the files, as soon as it is: in the log, and once to the pilot.
class FileTroubles {
 public:
  FileTroubles(const live::MapSaver* saver, const live::SessionRecorder* recorder)
      : saver_(saver), recorder_(recorder) {}
  void maybe(live::AutopilotLink& link);

 private:
  const live::MapSaver* saver_;
  const live::SessionRecorder* recorder_;
  std::size_t failed_ = 0;
  bool any_left_out_ = false;
  std::string ended_;
  Time last_;
};

/// What became of the frames and of the link.
std::string summary(const live::SessionCounts& counts, const live::LinkReport& link);

}  // namespace pade::cli
