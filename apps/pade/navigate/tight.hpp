// Raw GNSS beside an IMU, for the filter.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "pade/core/result.hpp"
#include "pade/core/sensors/navigation_log.hpp"
#include "pade/navigation/gnss/raw_run.hpp"
#include "pade/navigation/tight/raw_epoch.hpp"

namespace pade::cli {

/// Raw GNSS on the time scale of an IMU.
struct RawInput {
  gnss::RawLog log;
  std::vector<std::shared_ptr<const navigation::RawEpoch>> epochs;
  GeodeticOrigin origin;  ///< of the local frame: the first position
  std::string remark;     ///< which time scale the IMU was found to have
};

/// Reads the raw GNSS of a folder or file (io::read_raw_gnss). The IMU's stamps may be GPS time, seconds of
/// the GPS week, or Unix time: of these the one by which most epochs lie between all but the first and last
/// hundredth of the samples. Epochs behind the last sample are left out, with a remark, as is that there is
/// no Doppler, and that the receiver is noisier than assumed. Errors: those of the reader; no overlap; known
/// ranges, which have no Doppler; no position.
Result<RawInput> read_raw_input(const std::filesystem::path& path, const std::vector<ImuSample>& imu,
                                const gnss::PositioningOptions& options);

}  // namespace pade::cli
