// Whether the innovations of one sensor still look like noise (docs/navigation.md, section 6).
#pragma once

#include "pade/core/lie.hpp"
#include "pade/core/time.hpp"

namespace pade::navigation {

/// Innovations over the last seconds, in units of their predicted covariance. White ones of that covariance
/// add up like a random walk; a fault makes them point to one side, long before any of them passes its gate.
class InnovationWindow {
 public:
  /// @param white    S^(-1/2) r; unused components are zero
  /// @param learn    whether this sample tells what is usual for this sensor
  void add(const Vector3d& white, Time now, bool learn);

  /// Squared sum of the innovations over the variance that it would have, were they as usual: chi-square
  /// of as many degrees of freedom as the sensor has components. The larger one of 1 s and 4 s.
  [[nodiscard]] double drift() const;
  /// Mean of the squared innovations over the last second; as many as components are expected.
  [[nodiscard]] double level() const { return level_; }
  [[nodiscard]] Time newest() const { return newest_; }
  [[nodiscard]] bool empty() const { return empty_; }
  /// Begins anew: the filter has been changed. What is usual for the sensor stays.
  void forget();

 private:
  /// Decaying sum of innovations, and the variance that it has when they are white.
  struct Sum {
    Vector3d value = Vector3d::Zero();
    double variance = 0;
    void add(const Vector3d& white, double decay);
    [[nodiscard]] double drift() const { return variance > 0 ? value.squaredNorm() / variance : 0; }
  };

  Sum short_;
  Sum long_;
  double level_ = 0;
  // What is usual: receivers that smooth have innovations that follow each other.
  double power_ = 60;  ///< decaying sum of squares; 60: as if 20 samples had been white
  double lagged_ = 0;  ///< of products of neighbours
  Vector3d last_ = Vector3d::Zero();
  Time newest_;
  bool empty_ = true;
};

}  // namespace pade::navigation
