// A flight's log of IMU and GNSS as text files, right until a test changes something.
#pragma once

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>

#include <fmt/format.h>

#include "navigation/flight.hpp"

namespace pade::test {

inline void write_file(const std::filesystem::path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

struct Recording {
  NavigationLog log;
  std::string imu_head = "# frame=FLU\nt_s,gx,gy,gz,ax,ay,az\n";
  std::string gnss_head =
      "# frame=ENU "
      "origin=47.3769,8.5417,408\nt_s,px,py,pz,vx,vy,vz,sigma_px,sigma_py,sigma_pz,sigma_vx,sigma_vy,"
      "sigma_vz\n";
  std::string barometer;  ///< baro.csv
  bool velocities = true;
  double sigma = 1;  ///< times those of the GNSS

  /// Two seconds of rest, then a loop. @param speed  1 is gentle: up to about 1.5 m/s
  explicit Recording(double speed, double duration = 40)
      : log(navigation::record({.rest = 2, .speed = speed}, duration, simulation::ImuModel::consumer(),
                               simulation::GnssModel::single_point(), 3, 100)) {}

  void write(const std::filesystem::path& folder) const {
    std::string imu = imu_head;
    for (const ImuSample& s : log.imu) {
      imu += fmt::format("{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", to_string(s.time),
                         s.angular_rate.x(), s.angular_rate.y(), s.angular_rate.z(), s.specific_force.x(),
                         s.specific_force.y(), s.specific_force.z());
    }
    write_file(folder / "imu.csv", imu);
    std::string gnss = gnss_head;
    for (std::size_t i = 0; i < log.gnss.fixes.size(); ++i) {
      const GnssFix& p = log.gnss.fixes[i];
      const GnssVelocity& v = log.gnss.velocities[i];
      const Eigen::Vector3d sp = sigma * p.covariance.diagonal().cwiseSqrt();
      const Eigen::Vector3d sv = sigma * v.covariance.diagonal().cwiseSqrt();
      gnss += fmt::format("{},{:.9g},{:.9g},{:.9g}", to_string(p.time), p.position.x(), p.position.y(),
                          p.position.z());
      if (velocities)
        gnss += fmt::format(",{:.9g},{:.9g},{:.9g}", v.velocity.x(), v.velocity.y(), v.velocity.z());
      gnss += fmt::format(",{:.4g},{:.4g},{:.4g}", sp.x(), sp.y(), sp.z());
      gnss += velocities ? fmt::format(",{:.4g},{:.4g},{:.4g}\n", sv.x(), sv.y(), sv.z()) : "\n";
    }
    write_file(folder / "gnss.csv", gnss);
    if (!barometer.empty()) write_file(folder / "baro.csv", barometer);
  }

  void each_imu(const std::function<void(ImuSample&)>& change) {
    for (ImuSample& sample : log.imu) change(sample);
  }
  void each_velocity(const std::function<void(GnssVelocity&)>& change) {
    for (GnssVelocity& velocity : log.gnss.velocities) change(velocity);
  }
  void each_fix(const std::function<void(GnssFix&)>& change) {
    for (GnssFix& fix : log.gnss.fixes) change(fix);
  }
  void shift_imu(double seconds) {
    each_imu([=](ImuSample& s) { s.time.nanoseconds += Time::from_seconds(seconds).nanoseconds; });
  }
  void shift_gnss(double seconds) {
    const auto by = Time::from_seconds(seconds).nanoseconds;
    each_fix([=](GnssFix& f) { f.time.nanoseconds += by; });
    each_velocity([=](GnssVelocity& v) { v.time.nanoseconds += by; });
  }
};

/// A barometer once per second: `height(t)`.
inline std::string barometer(double duration, const std::function<double(double)>& height) {
  std::string text = "t_s,height_m,sigma_m\n";
  for (double t = 0; t < duration; t += 0.2) text += fmt::format("{:.3f},{:.3f},0.1\n", t, height(t));
  return text;
}

}  // namespace pade::test
