#include "pade/simulation/flight/sensor_files.hpp"

#include <cmath>

#include <fmt/format.h>

#include "pade/simulation/flight/sensors/aiding.hpp"
#include "pade/simulation/flight/sensors/imu.hpp"

namespace pade::simulation {
namespace {

// Each instrument has a stream of its own, so that switching one off does not change another.
constexpr std::uint64_t kImuStream = 0x11;
constexpr std::uint64_t kGnssStream = 0x22;
constexpr std::uint64_t kBaroStream = 0x33;
constexpr std::uint64_t kMagStream = 0x44;

std::uint64_t stream(std::uint64_t seed, std::uint64_t instrument) {
  return seed * 0x9e3779b97f4a7c15ULL + instrument;
}

/// Calls `take` with the true state at every multiple of 1 / rate up to `end`.
template <class Take>
void sampled(const Trajectory& path, double rate, double end, const Take& take) {
  for (int i = 0; i / rate <= end + 1e-9; ++i) take(path.at(i / rate));
}

std::string fields(const Eigen::Vector3d& v) {
  return fmt::format(",{:.9g},{:.9g},{:.9g}", v.x(), v.y(), v.z());
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

std::map<std::string, std::string> sensor_files(const Trajectory& path, const SensorOptions& options,
                                                std::uint64_t seed) {
  std::map<std::string, std::string> files;

  Imu imu(imu_model(options.imu), stream(seed, kImuStream));
  std::string& inertial = files["imu.csv"] = "# frame=FLU\nt_s,gx,gy,gz,ax,ay,az\n";
  sampled(path, options.imu_rate, path.duration(), [&](const KinematicState& truth) {
    const ImuSample sample = imu.sample(truth);
    inertial += to_string(sample.time) + fields(sample.angular_rate) + fields(sample.specific_force) + '\n';
  });

  Gnss gnss(options.gnss_carrier_phase ? GnssModel::carrier_phase() : GnssModel::single_point(),
            stream(seed, kGnssStream));
  std::string origin(geographic_origin_text);
  std::erase(origin, ' ');
  std::string& satellite = files["gnss.csv"] = fmt::format(
      "# frame=ENU origin={}\nt_s,px,py,pz,vx,vy,vz,sigma_px,sigma_py,sigma_pz,sigma_vx,sigma_vy,sigma_vz\n",
      origin);
  sampled(path, options.gnss_rate, path.duration() - options.gnss_latency, [&](const KinematicState& truth) {
    const GnssEpoch epoch = gnss.sample(truth);
    satellite += to_string(epoch.fix.time) + fields(epoch.fix.position) + fields(epoch.velocity.velocity) +
                 fields(epoch.fix.covariance.diagonal().cwiseSqrt()) +
                 fields(epoch.velocity.covariance.diagonal().cwiseSqrt()) + '\n';
  });

  Barometer barometer({}, stream(seed, kBaroStream));
  std::string& height = files["baro.csv"] = "# frame=ENU\nt_s,height_m\n";
  sampled(path, options.baro_rate, path.duration(), [&](const KinematicState& truth) {
    const BarometricHeight sample = barometer.sample(truth);
    height += fmt::format("{},{:.6g}\n", to_string(sample.time), sample.height);
  });

  Magnetometer magnetometer({}, stream(seed, kMagStream));
  std::string& compass = files["mag.csv"] = "# frame=FLU\nt_s,mx,my,mz\n";
  sampled(path, options.mag_rate, path.duration(), [&](const KinematicState& truth) {
    const MagneticField sample = magnetometer.sample(truth);
    compass += to_string(sample.time) + fields(sample.field) + '\n';
  });

  std::string& truth_rows = files["body_truth.txt"] =
      "# timestamp tx ty tz qx qy qz qw: T_world_body, body FLU, world ENU, metres\n";
  constexpr double kTruthRate = 100;
  sampled(path, kTruthRate, path.duration(), [&](const KinematicState& truth) {
    const Eigen::Quaterniond& q = truth.R_world_body;
    truth_rows +=
        fmt::format("{} {:.9f} {:.9f} {:.9f} {:.12f} {:.12f} {:.12f} {:.12f}\n", to_string(truth.time),
                    truth.position.x(), truth.position.y(), truth.position.z(), q.x(), q.y(), q.z(), q.w());
  });
  return files;
}

}  // namespace pade::simulation
