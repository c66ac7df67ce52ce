#include "pade/simulation/flight/sensor_files.hpp"

#include <cmath>

#include <fmt/format.h>

#include "pade/simulation/flight/sensor_suite.hpp"

namespace pade::simulation {
namespace {

/// Calls `take` with the true state at every multiple of 1 / rate up to `end`.
template <class Take>
void sampled(const Trajectory& path, double rate, double end, const Take& take) {
  for (int i = 0; i / rate <= end + 1e-9; ++i) take(path.at(i / rate));
}

std::string fields(const Eigen::Vector3d& v) {
  return fmt::format(",{:.9g},{:.9g},{:.9g}", v.x(), v.y(), v.z());
}

}  // namespace

std::map<std::string, std::string> sensor_files(const Trajectory& path, const SensorOptions& options,
                                                std::uint64_t seed) {
  std::map<std::string, std::string> files;

  SensorSuite sensors(options, seed);
  std::string& inertial = files["imu.csv"] = "# frame=FLU\nt_s,gx,gy,gz,ax,ay,az\n";
  sampled(path, options.imu_rate, path.duration(), [&](const KinematicState& truth) {
    const ImuSample sample = sensors.imu.sample(truth);
    inertial += to_string(sample.time) + fields(sample.angular_rate) + fields(sample.specific_force) + '\n';
  });

  std::string origin(geographic_origin_text);
  std::erase(origin, ' ');
  std::string& satellite = files["gnss.csv"] = fmt::format(
      "# frame=ENU origin={}\nt_s,px,py,pz,vx,vy,vz,sigma_px,sigma_py,sigma_pz,sigma_vx,sigma_vy,sigma_vz\n",
      origin);
  sampled(path, options.gnss_rate, path.duration() - options.gnss_latency, [&](const KinematicState& truth) {
    const GnssEpoch epoch = sensors.gnss.sample(truth);
    satellite += to_string(epoch.fix.time) + fields(epoch.fix.position) + fields(epoch.velocity.velocity) +
                 fields(epoch.fix.covariance.diagonal().cwiseSqrt()) +
                 fields(epoch.velocity.covariance.diagonal().cwiseSqrt()) + '\n';
  });

  std::string& height = files["baro.csv"] = "# frame=ENU\nt_s,height_m\n";
  sampled(path, options.baro_rate, path.duration(), [&](const KinematicState& truth) {
    const BarometricHeight sample = sensors.barometer.sample(truth);
    height += fmt::format("{},{:.6g}\n", to_string(sample.time), sample.height);
  });

  std::string& compass = files["mag.csv"] = "# frame=FLU\nt_s,mx,my,mz\n";
  sampled(path, options.mag_rate, path.duration(), [&](const KinematicState& truth) {
    const MagneticField sample = sensors.magnetometer.sample(truth);
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
