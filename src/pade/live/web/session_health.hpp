// How a session is, for people: rates, latency, what was dropped, clock, GPS/INS, processor.
#pragma once

#include <cstddef>
#include <deque>
#include <string>

#include "pade/core/time.hpp"
#include "pade/io/recording/messages/display_messages.hpp"
#include "pade/live/link/autopilot_link.hpp"
#include "pade/live/link/health.hpp"
#include "pade/live/session.hpp"

namespace pade::live {

/// Of the clients of a WebServer.
struct WebCounts {
  std::size_t clients = 0;   ///< WebSockets open now
  std::size_t come = 0;      ///< so far
  std::size_t dropped = 0;   ///< messages that newer ones took the place of, of all clients so far
  std::size_t refused = 0;   ///< requests
  std::string last_refusal;  ///< why; empty: none was refused
};

/// What is known at a moment.
struct HealthInputs {
  Time now;
  std::int64_t image = 0;  ///< Progress::image
  std::int64_t depth = 0;  ///< Progress::depth
  SessionCounts counts;
  LinkReport link;
  std::string missing;  ///< text_of(link, poses)
  std::string stamps;   ///< stamp_text(); empty: nothing is certain
  double latency = 0;   ///< from exposure to the map, median of the last frames, s; NaN: none yet
  double latency_95 = 0;
  double depth_share = 0;    ///< of the last frame
  std::size_t occupied = 0;  ///< voxels
  WebCounts web;
};

/// Makes rates of counts. One thread.
class SessionHealth {
 public:
  /// @param inputs  later than those before
  [[nodiscard]] io::Diagnosis of(const HealthInputs& inputs);

 private:
  struct Past {
    Time time;
    std::size_t frames = 0, mapped = 0, sectors = 0, poses = 0;
    double processor = 0;  ///< s
  };
  std::deque<Past> past_;
};

/// {"level": 0, "message": "...", "values": {...}}: the same texts.
std::string json_of(const io::Diagnosis& diagnosis);

}  // namespace pade::live
