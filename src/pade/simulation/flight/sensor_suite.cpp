#include "pade/simulation/flight/sensor_suite.hpp"

namespace pade::simulation {
namespace {

constexpr std::uint64_t kImuStream = 0x11;
constexpr std::uint64_t kGnssStream = 0x22;
constexpr std::uint64_t kBaroStream = 0x33;
constexpr std::uint64_t kMagStream = 0x44;

std::uint64_t stream(std::uint64_t seed, std::uint64_t instrument) {
  return seed * 0x9e3779b97f4a7c15ULL + instrument;
}

ImuModel imu_model(SensorGrade grade) {
  switch (grade) {
    case SensorGrade::perfect:
      return ImuModel::perfect();
    case SensorGrade::industrial:
      return ImuModel::industrial();
    case SensorGrade::consumer:
      break;
  }
  return ImuModel::consumer();
}

}  // namespace

SensorSuite::SensorSuite(const SensorOptions& options, std::uint64_t seed)
    : imu(imu_model(options.imu), stream(seed, kImuStream)),
      gnss(options.gnss_carrier_phase ? GnssModel::carrier_phase() : GnssModel::single_point(),
           stream(seed, kGnssStream)),
      barometer({}, stream(seed, kBaroStream)),
      magnetometer({}, stream(seed, kMagStream)) {}

}  // namespace pade::simulation
