// Plays a log into a Navigator in the order in which the data would have arrived.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "pade/core/sensors/navigation_log.hpp"
#include "pade/navigation/navigator.hpp"
#include "pade/navigation/tight/raw_epoch.hpp"

namespace pade::navigation {

struct ReplayOptions {
  Time from{INT64_MIN};  ///< data stamped before is not played
  Time to{INT64_MAX};
  double gnss_delay_low = 0;      ///< GNSS arrives this much after its stamp, drawn uniformly per message
  double gnss_delay_high = 0;     ///< (so that messages overtake each other), s
  std::uint64_t seed = 1;         ///< of the delays
  std::vector<Heading> headings;  ///< further measurements
  std::vector<std::shared_ptr<const RawEpoch>> raw;  ///< raw GNSS, in any order; none is null
  double road_rate = 0;  ///< RoadMotion so many times a second: a vehicle on wheels, Hz
};

/// Calls `after_imu(stamp)` behind each IMU sample. At one moment aiding data arrives before the IMU sample.
void replay(const NavigationLog& log, Navigator& navigator, const ReplayOptions& options,
            const std::function<void(Time)>& after_imu);

}  // namespace pade::navigation
