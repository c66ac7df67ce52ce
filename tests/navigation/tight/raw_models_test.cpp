// Predictions of raw GNSS against numeric derivatives and against the geometry in the frame of the Earth; the
// update by single measurements against the textbook's.
#include <Eigen/LU>
#include <gtest/gtest.h>

#include "pade/core/random.hpp"
#include "pade/navigation/tight/raw_information.hpp"
#include "pade/navigation/tight/raw_observer.hpp"

#include "navigation/gnss/constellation.hpp"
#include "navigation/numeric_jacobian.hpp"

namespace pade::navigation {
namespace {

RawVariables random_variables(Random& random) {
  RawVariables x;
  x.position = 100 * random.normal3();
  x.velocity = 10 * random.normal3();
  x.position_bias = random.normal3();
  x.receiver.clock = 1e5 * random.normal();
  x.receiver.drift = 100 * random.normal();
  x.receiver.system_bias = 10 * random.normal3();
  x.receiver.anchor_position = 100 * random.normal3();
  x.receiver.anchor_clock = 1e5 * random.normal();
  return x;
}

RawSatellite random_satellite(Random& random) {
  RawSatellite s;
  s.satellite.system = static_cast<gnss::System>(random.uniform(0, 3.999));
  s.position = 2.3e7 * random.normal3().normalized();
  s.velocity = 3000 * random.normal3().normalized();
  return s;
}

std::string name_of(RawKind kind) {
  if (kind == RawKind::range) return "Range";
  return kind == RawKind::rate ? "Rate" : "Phase";
}

class RawModel : public testing::TestWithParam<RawKind> {
 protected:
  static RawPrediction predict(const RawVariables& x, const RawSatellite& s, const AnchoredPhase& anchor) {
    if (GetParam() == RawKind::range) return predict_range(x, s);
    if (GetParam() == RawKind::rate) return predict_rate(x, s);
    return predict_phase_change(x, s, anchor);
  }
};

TEST_P(RawModel, HasTheDerivativeOfItsOwnPrediction) {
  Random random(1);
  for (int i = 0; i < 50; ++i) {
    const RawVariables x = random_variables(random);
    const RawSatellite s = random_satellite(random);
    AnchoredPhase anchor;
    anchor.position = s.position + 3000 * random.normal3();
    // At 2.3e7 m a double resolves 4 nm: the step is large, and nothing bends within it.
    const auto numeric = numeric_jacobian<1, kRawVariables>(
        [&](const RawRow& error) {
          RawVariables moved = x;
          moved.retract(error);
          return Eigen::Matrix<double, 1, 1>(predict(moved, s, anchor).value);
        },
        1.0);
    EXPECT_LT((predict(x, s, anchor).row.transpose() - numeric).cwiseAbs().maxCoeff(), 2e-7) << i;
  }
}
INSTANTIATE_TEST_SUITE_P(Of, RawModel, testing::Values(RawKind::range, RawKind::rate, RawKind::phase),
                         [](const auto& parameter) { return name_of(parameter.param); });

TEST(RawObserver, PlacesSatellitesSoThatDistanceAndRateAreThoseOfTheTurningEarth) {
  const gnss::BroadcastData data = gnss::sky();
  gnss::Receiver receiver{gnss::curve()};
  const gnss::Epoch epoch = gnss::observe(data, receiver, 3);
  RawObserver observer(data, {}, LocalFrame::at(gnss::geodetic_of(gnss::stuttgart())), gnss::noon());
  const auto made = observer.observe(epoch);
  ASSERT_TRUE(made);
  ASSERT_GT(made->satellites.size(), 10U);
  const Vector3d at = receiver.path(3);
  const Vector3d velocity = (receiver.path(3.001) - receiver.path(2.999)) / 0.002;
  RawVariables x;
  x.position = observer.frame()->R_enu_ecef * (at - observer.frame()->origin);
  x.velocity = observer.frame()->R_enu_ecef * velocity;
  for (const RawSatellite& s : made->satellites) {
    const auto signal = std::find_if(epoch.signals.begin(), epoch.signals.end(),
                                     [&](const auto& v) { return v.satellite == s.satellite; });
    const auto state = gnss::state_at_transmission(gnss::choose_ephemeris(data, s.satellite, epoch.time),
                                                   epoch.time, *signal->pseudorange);
    EXPECT_NEAR((s.position - x.position).norm(), gnss::range_between(state.position, at), 1e-3);
    EXPECT_NEAR(predict_rate(x, s).value, gnss::range_rate_between(state, at, velocity), 2e-5);
  }
}

/// Measurements of random variables of unequal spread.
RawEquations random_equations(Random& random, const RawRow& truth, std::size_t count) {
  RawEquations equations;
  for (std::size_t i = 0; i < count; ++i) {
    RawEquation& e = equations.add();
    for (int k = 0; k < kRawVariables; ++k) e.row[k] = random.normal();
    const double sigma = 0.5 + 0.5 * random.uniform();
    e.variance = sigma * sigma;
    e.residual = e.row.dot(truth) + sigma * random.normal();
  }
  return equations;
}

RawMatrix random_covariance(Random& random) {
  RawMatrix root;
  for (int i = 0; i < kRawVariables; ++i) {
    for (int j = 0; j < kRawVariables; ++j) root(i, j) = random.normal();
  }
  return root * root.transpose();
}

TEST(RawInformation, IsTheKalmanUpdateByAllMeasurementsAtOnce) {
  Random random(2);
  const RawMatrix S = random_covariance(random);
  RawEquations equations = random_equations(random, RawRow::Ones(), 25);
  for (RawEquation& e : equations) e.spread = S * e.row;
  const RawInformation information = combined(equations);
  Eigen::MatrixXd H(25, kRawVariables);
  Eigen::VectorXd r(25);
  Eigen::MatrixXd R = Eigen::MatrixXd::Zero(25, 25);
  for (int i = 0; i < 25; ++i) {
    const RawEquation& e = equations.all[static_cast<std::size_t>(i)];
    H.row(i) = e.row.transpose();
    r[i] = e.residual;
    R(i, i) = e.variance;
  }
  const Eigen::MatrixXd inverse = (H * S * H.transpose() + R).inverse();
  EXPECT_LT((information.gain - H.transpose() * inverse * H).norm(), 1e-9);
  EXPECT_LT((information.mean - H.transpose() * inverse * r).norm(), 1e-9);
}

TEST(RawInformation, LeavesOutWhatContradictsTheOthersThoughThePriorIsWide) {
  Random random(3);
  int wrong_used = 0, good_refused = 0;
  for (int run = 0; run < 20; ++run) {
    // Nothing is known of place and clock.
    RawMatrix S = 0.01 * RawMatrix::Identity();
    RawRow truth = RawRow::Zero();
    for (const int i : {0, 1, 2, kOfReceiver}) {
      S(i, i) = 1e4;
      truth[i] = 50;
    }
    RawEquations equations = random_equations(random, truth, 60);
    for (std::size_t i = 0; i < 10; ++i) equations.all[i].residual += random.uniform() < 0.5 ? 30 : -50;
    fit(equations, S, 4);
    for (std::size_t i = 0; i < 60; ++i) {
      wrong_used += i < 10 && equations.all[i].used ? 1 : 0;
      good_refused += i >= 10 && !equations.all[i].used ? 1 : 0;
    }
  }
  EXPECT_EQ(wrong_used, 0);
  EXPECT_LE(good_refused, 3);
}

TEST(RawInformation, RefusesWhatContradictsANarrowPrior) {
  Random random(4);
  RawEquations equations = random_equations(random, RawRow::Zero(), 6);
  // Most of them are wrong, and alike: only the prior can tell.
  for (std::size_t i = 0; i < 4; ++i) equations.all[i].residual += 20;
  fit(equations, 1e-4 * RawMatrix::Identity(), 4);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(equations.all[i].used, i >= 4) << i;
}

}  // namespace
}  // namespace pade::navigation
