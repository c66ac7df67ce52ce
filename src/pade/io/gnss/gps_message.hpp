// What GPS satellites send on L1 (LNAV): subframes become ephemerides.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>

#include "pade/core/sensors/raw_gnss.hpp"

namespace pade::io {

/// Gathers the subframes of each satellite until three belong together.
class GpsMessage {
 public:
  /// A subframe's ten words, 24 bits of data in each (without parity).
  struct Words {
    gnss::SatelliteId satellite;
    std::array<std::uint32_t, 10> data{};
  };

  /// Appends an ephemeris, once, when subframes 1 to 3 of one issue are there; sets the ionosphere's model
  /// from page 18 of subframe 4. Others are passed over.
  /// @param near  a time within half a week of toe, which says what week it is
  void add(const Words& subframe, Time near, gnss::BroadcastData& broadcast);

 private:
  std::map<gnss::SatelliteId, std::array<std::optional<Words>, 3>> gathered_;
};

}  // namespace pade::io
