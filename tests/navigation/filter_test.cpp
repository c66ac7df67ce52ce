#include "pade/navigation/filter.hpp"

#include <Eigen/Eigenvalues>
#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade::navigation {
namespace {

const Vector3d kAntenna(0.2, 0, 0.1);

Time stamp(double seconds) { return Time::from_seconds(seconds); }

BaseMatrix loose_covariance() {
  BaseMatrix P = BaseMatrix::Zero();
  P.diagonal() << Vector3d::Constant(0.01), Vector3d::Constant(0.25), Vector3d::Constant(25.0),
      Vector3d::Constant(1e-4), Vector3d::Constant(0.01), Vector3d::Zero(), 0;
  return P;
}

Filter started(const Vector3d& lever = kAntenna) {
  Filter filter(FilterOptions{}, lever);
  filter.start(NavigationState{}, loose_covariance());
  return filter;
}

/// A second of flight at 200 Hz, turning and accelerating.
void fly(Filter& filter, double until) {
  const auto rate = [](double t) { return Vector3d(0.3 * std::sin(3 * t), 0.2, 0.5 * std::cos(2 * t)); };
  const auto force = [](double t) { return Vector3d(std::sin(2 * t), 0.5 * std::cos(3 * t), 9.8); };
  for (double t = filter.state().time.seconds(); t < until - 1e-9; t += 0.005) {
    filter.propagate(stamp(t + 0.005), rate(t + 0.0025), force(t + 0.0025), rate(t + 0.005));
  }
}

void expect_covariance(const BaseMatrix& P) {
  EXPECT_TRUE(P.allFinite());
  EXPECT_LT((P - P.transpose()).cwiseAbs().maxCoeff(), 1e-9 * P.cwiseAbs().maxCoeff());
  const Eigen::SelfAdjointEigenSolver<BaseMatrix> solver(P);
  EXPECT_GT(solver.eigenvalues().minCoeff(), -1e-10 * solver.eigenvalues().maxCoeff());
}

TEST(Filter, PropagatesTheSameCovarianceInOneStrideAsInMany) {
  Filter one = started();
  Filter many = started();
  fly(one, 1);
  for (int i = 1; i <= 100; ++i) {
    fly(many, 0.01 * i);
    many.covariance();  // forces the accumulated transition out
  }
  const BaseMatrix a = one.covariance();
  const BaseMatrix b = many.covariance();
  // Bias walk within a stride is left out of the cross terms: a second order of the stride.
  EXPECT_LT((a - b).cwiseAbs().maxCoeff(), 1e-4 * a.cwiseAbs().maxCoeff());
  EXPECT_LT((one.state().X.p - many.state().X.p).norm(), 1e-9);
}

TEST(Vibration, IsTheSpreadOfTheSamplesWhateverTheMotion) {
  Random random(4);
  Vibration vibration;
  Vibration calm;
  for (int i = 0; i < 4000; ++i) {
    const double t = 0.005 * i;
    const Vector3d rate(std::sin(5 * t), 0.5 * std::cos(3 * t), 1);
    const Vector3d force(3 * std::sin(4 * t), 2 * std::cos(2 * t), 9.8);
    calm.observe({stamp(t), rate, force}, 0.06);
    vibration.observe({stamp(t), rate + 0.1 * random.normal3(), force + 0.7 * random.normal3()}, 0.06);
  }
  EXPECT_LT(calm.rate_variance.maxCoeff(), 1e-7);
  EXPECT_LT(calm.force_variance.maxCoeff(), 1e-6);
  EXPECT_NEAR(vibration.interval, 0.005, 1e-5);
  for (int axis = 0; axis < 3; ++axis) {  // averaged over about 200 samples
    EXPECT_NEAR(std::sqrt(vibration.rate_variance[axis]), 0.1, 0.02);
    EXPECT_NEAR(std::sqrt(vibration.force_variance[axis]), 0.7, 0.14);
  }
}

TEST(Vibration, DoesNotTakeAGapForVibration) {
  Vibration vibration;
  for (int i = 0; i < 2000; ++i) {
    const double t = i < 1000 ? 0.005 * i : 0.005 * i + 0.8;
    vibration.observe({stamp(t), Vector3d(0.5 * t, 0, 0), Vector3d(0, 0, 9.8 + t)}, 0.06);
  }
  EXPECT_LT(vibration.rate_variance.maxCoeff(), 1e-7);
  EXPECT_LT(vibration.force_variance.maxCoeff(), 1e-4);
}

TEST(Filter, GrowsItsDoubtWithTheVibration) {
  double sigma[2];
  for (int k = 0; k < 2; ++k) {
    Filter filter = started();
    Random random(4);
    for (int i = 1; i <= 1000; ++i) {
      const Vector3d force = Vector3d(0, 0, 9.8) + (k == 0 ? 0.1 : 4.0) * random.normal3();
      filter.propagate(stamp(0.005 * i), Vector3d::Zero(), force, Vector3d::Zero());
      filter.observe({stamp(0.005 * i), Vector3d::Zero(), force});
      if (i % 40 == 0)
        filter.update(GnssVelocity{stamp(0.005 * i), filter.state().X.v, 2.5e-3 * Matrix3d::Identity()});
    }
    sigma[k] = std::sqrt(filter.covariance()(kNu, kNu));
  }
  EXPECT_GT(sigma[1], 1.2 * sigma[0]);
}

TEST(Filter, KeepsASymmetricPositiveCovarianceThroughAnything) {
  Filter filter = started();
  Random random(1);
  for (int i = 1; i < 600; ++i) {
    fly(filter, 0.1 * i);
    filter.update(GnssFix{filter.state().time, 100 * random.normal3(), 1e-6 * Matrix3d::Identity()});
    filter.update(GnssVelocity{filter.state().time, 10 * random.normal3(), Matrix3d::Zero()});
    filter.update(ZeroVelocity{filter.state().time, 0});
    filter.update(Heading{filter.state().time, random.uniform(-9, 9), 1e-9});
    if (i % 100 == 0) filter.add_gap_noise(0, 1);
    expect_covariance(filter.covariance());
    ASSERT_TRUE(filter.state().X.p.allFinite());
  }
}

TEST(Filter, ReportsAPerfectlyKnownMotionBetweenCloneAndNowAtOnce) {
  Filter filter = started();
  fly(filter, 1);
  const int clone = filter.clone();
  const CloneMotion motion = filter.motion_since(clone);
  EXPECT_LT(motion.T_1_2.translation.norm(), 1e-12);
  EXPECT_LT(motion.covariance.cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Filter, RelativeMotionIsFarBetterKnownThanEitherPose) {
  Filter filter = started();
  fly(filter, 1);
  const int clone = filter.clone();
  fly(filter, 1.1);
  const double relative = filter.motion_since(clone).covariance.block<3, 3>(3, 3).trace();
  const double absolute = filter.covariance().block<3, 3>(kRho, kRho).trace();
  EXPECT_LT(relative, 0.01 * absolute);
}

TEST(Filter, ACloneIsCorrectedByMeasurementsThatComeLater) {
  Filter filter = started(Vector3d::Zero());
  fly(filter, 1);
  const Vector3d first = filter.state().X.p;
  const int clone = filter.clone();
  fly(filter, 1.1);
  const Pose before = filter.motion_since(clone).T_1_2;
  // A common shift of both poses explains the fix: the motion between them hardly changes.
  filter.update(
      GnssFix{filter.state().time, filter.state().X.p + Vector3d(4, -3, 2), 1e-2 * Matrix3d::Identity()});
  EXPECT_GT((filter.state().X.p - first).norm(), 2);
  EXPECT_LT((filter.motion_since(clone).T_1_2.translation - before.translation).norm(), 0.15);
}

TEST(Filter, RelativeCovarianceMatchesManyRunsWithErrorsDrawnFromTheStartingCovariance) {
  Filter reference = started();
  fly(reference, 0.2);
  const int clone = reference.clone();
  fly(reference, 0.5);
  const CloneMotion motion = reference.motion_since(clone);
  Filter noiseless_model(FilterOptions{.gyroscope_noise = 0,
                                       .accelerometer_noise = 0,
                                       .gyroscope_vibration = 0,
                                       .accelerometer_vibration = 0},
                         kAntenna);
  noiseless_model.start(NavigationState{}, loose_covariance());
  fly(noiseless_model, 0.2);
  noiseless_model.clone();
  fly(noiseless_model, 0.5);
  const Matrix6d predicted = noiseless_model.motion_since(0).covariance;
  const Eigen::LLT<Matrix6d> factor(predicted);

  Random random(2);
  const BaseMatrix start = 1e-4 * loose_covariance();  // small: the statement is of first order
  Matrix6d whitened = Matrix6d::Zero();
  const int runs = 3000;
  for (int run = 0; run < runs; ++run) {
    BaseVector error;
    for (int i = 0; i < kBase; ++i) error[i] = std::sqrt(start(i, i)) * random.normal();
    NavigationState state;
    state.retract(error);
    Filter truth(FilterOptions{}, kAntenna);
    truth.start(state, loose_covariance());
    fly(truth, 0.2);
    const int index = truth.clone();
    fly(truth, 0.5);
    const Pose difference = motion.T_1_2.inverse() * truth.motion_since(index).T_1_2;
    Vector6d xi;
    xi << rotation_log(difference.rotation), difference.translation;
    const Vector6d white = factor.matrixL().solve(100 * xi);
    whitened += white * white.transpose() / runs;
  }
  EXPECT_LT((whitened - Matrix6d::Identity()).cwiseAbs().maxCoeff(), 0.15) << whitened;
}

TEST(Filter, RejectsAnOutlierAndSaysSo) {
  Filter filter = started(Vector3d::Zero());
  for (int i = 1; i <= 20; ++i) {
    fly(filter, 0.1 * i);
    filter.update(GnssVelocity{filter.state().time, filter.state().X.v, 0.0025 * Matrix3d::Identity()});
  }
  const Vector3d before = filter.state().X.v;
  const Innovation innovation = filter.update(
      GnssVelocity{filter.state().time, before + Vector3d(5, 0, 0), 0.0025 * Matrix3d::Identity()});
  EXPECT_EQ(innovation.verdict, Verdict::rejected);
  EXPECT_EQ(filter.state().X.v, before);
}

TEST(Filter, InflatesTheNoiseOfAMeasurementJustOutsideTheGate) {
  Filter filter = started(Vector3d::Zero());
  const Vector3d residual(0.5 * 4.5, 0, 0);  // 4.5 sigma: chi-square 20
  const Innovation innovation = filter.update(GnssVelocity{Time{}, residual, 1e-6 * Matrix3d::Identity()});
  EXPECT_EQ(innovation.verdict, Verdict::inflated);
  EXPECT_GT(filter.state().X.v.x(), 0.1);
  EXPECT_LT(filter.state().X.v.x(), residual.x());
}

TEST(Filter, BelievesAPositionStepAfterASecondAndLeavesTheMotionAlone) {
  Filter filter = started(Vector3d::Zero());
  const Matrix3d noise = 1e-4 * Matrix3d::Identity();
  for (int i = 1; i <= 20; ++i) {
    fly(filter, 0.2 * i);
    filter.update(GnssFix{filter.state().time, filter.state().X.p, noise});
    filter.update(GnssVelocity{filter.state().time, filter.state().X.v, noise});
  }
  const Vector3d step(30, 0, 0);
  Filter undisturbed = filter;
  Verdict verdict = Verdict::accepted;
  double until = filter.state().time.seconds();
  while (verdict != Verdict::reacquired) {
    until += 0.2;
    ASSERT_LT(until, 8) << "never re-acquired";
    fly(undisturbed, until);
    fly(filter, until);
    const int clone = filter.clone();
    const Innovation innovation =
        filter.update(GnssFix{filter.state().time, undisturbed.state().X.p + step, noise});
    verdict = innovation.verdict;
    EXPECT_LT(filter.motion_since(clone).T_1_2.translation.norm(), 1e-6) << "a jump is not a motion";
    filter.drop_clones();
    if (verdict == Verdict::reacquired) {
      EXPECT_NEAR(innovation.jump, 30, 0.5);
    }
  }
  EXPECT_LT((filter.state().X.v - undisturbed.state().X.v).norm(), 0.05);
  EXPECT_LT((filter.smooth_pose().p - undisturbed.state().X.p).norm(), 1) << "the smooth pose does not jump";
}

TEST(Filter, AReceiverThatLosesItsFixedAmbiguitiesGetsABiasAtOnce) {
  Filter filter = started(Vector3d::Zero());
  filter.update(GnssFix{Time{}, Vector3d::Zero(), 1e-4 * Matrix3d::Identity()});
  EXPECT_LT(std::sqrt(filter.covariance()(kPositionBias, kPositionBias)), 0.01);
  filter.update(GnssFix{Time{}, Vector3d(2, 0, 0), Matrix3d::Identity()});
  EXPECT_NEAR(filter.state().position_bias.x(), 2, 0.2) << "the step is explained by the bias, not by motion";
}

TEST(Filter, IgnoresMeasurementsThatAreNotFinite) {
  Filter filter = started();
  const BaseMatrix before = filter.covariance();
  const double nan = std::nan("");
  EXPECT_EQ(filter.update(GnssFix{Time{}, {nan, 0, 0}, Matrix3d::Identity()}).verdict, Verdict::unusable);
  EXPECT_EQ(filter.update(GnssVelocity{Time{}, {nan, 0, 0}, Matrix3d::Identity()}).verdict,
            Verdict::unusable);
  EXPECT_EQ(filter.update(BarometricHeight{Time{}, nan, 1}).verdict, Verdict::unusable);
  EXPECT_EQ(filter.update(Heading{Time{}, nan, 1}).verdict, Verdict::unusable);
  EXPECT_EQ(filter.update(RangeToGround{Time{}, nan, 1, 0}).verdict, Verdict::unusable);
  EXPECT_EQ(filter.covariance(), before);
}

}  // namespace
}  // namespace pade::navigation
