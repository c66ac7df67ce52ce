// The turns of a body by its gyroscope, between any two times.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "pade/core/sensors/measurements.hpp"
#include "pade/core/time.hpp"

namespace pade {

/// Turn of a body over a span of time.
struct BodyTurn {
  Eigen::Quaterniond R_1_2 = Eigen::Quaterniond::Identity();  ///< directions of the later body in the earlier
  Eigen::Vector3d rate_1 = Eigen::Vector3d::Zero();           ///< of turn at the ends, body axes, rad/s
  Eigen::Vector3d rate_2 = Eigen::Vector3d::Zero();           ///< the same at the later one
};

/// A gyroscope's samples, integrated as the navigation filter does it: rates run straight from sample to
/// sample. Samples that do not come later than all before are left out.
class GyroTrack {
 public:
  explicit GyroTrack(const std::vector<ImuSample>& samples);

  [[nodiscard]] bool empty() const { return times_.size() < 2; }
  [[nodiscard]] Time first() const { return times_.front(); }  ///< @pre not empty
  [[nodiscard]] Time last() const { return times_.back(); }    ///< the same
  [[nodiscard]] double interval() const { return interval_; }  ///< between samples, median, s
  /// Root of mean square of the rates about their mean, rad/s.
  [[nodiscard]] double spread() const;
  /// Of white noise in the turns, rad²/s: by the second differences of the rates, which motion hardly has.
  [[nodiscard]] double noise() const;
  /// Empty outside of the samples, and where they have a gap of more than 0.1 s and five intervals.
  [[nodiscard]] std::optional<BodyTurn> between(Time from, Time to) const;

 private:
  struct At {
    std::size_t interval;
    Eigen::Quaterniond R;  // since the first sample
    Eigen::Vector3d rate;
  };
  [[nodiscard]] std::optional<At> at(Time time) const;

  std::vector<Time> times_;
  std::vector<Eigen::Vector3d> rates_;
  std::vector<Eigen::Quaterniond> turned_;
  std::vector<std::size_t> gaps_;  // number of gaps up to each sample
  double interval_ = 0;
};

}  // namespace pade
