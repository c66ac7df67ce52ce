// Whether the filter's own watch sees drifts, and nothing but drifts.
#include "pade/navigation/integrity/integrity.hpp"

#include <cmath>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"

namespace pade::navigation {
namespace {

constexpr double kBound = 42;  // FilterOptions::drift_bound

Time at(double seconds) { return Time::from_seconds(seconds); }

TEST(InnovationWindow, WhiteNoiseOfTheRightCovarianceIsNoDrift) {
  Random random(1);
  InnovationWindow window;
  double largest = 0;
  double mean = 0;
  const int count = 5 * 3600;
  for (int i = 0; i < count; ++i) {
    window.add(random.normal3(), at(0.2 * i), true);
    largest = std::max(largest, window.drift());
    mean += window.level() / count;
  }
  EXPECT_LT(largest, 0.75 * kBound) << "an hour at 5 Hz";
  EXPECT_NEAR(mean, 3, 0.1);
}

TEST(InnovationWindow, AShiftOfTwoSigmasIsSeenWithinSecondsAndOneOutlierNever) {
  Random random(2);
  for (int direction = 0; direction < 3; ++direction) {
    InnovationWindow window;
    int i = 0;
    for (; i < 200; ++i) window.add(random.normal3(), at(0.2 * i), true);
    window.add(1e6 * Vector3d::Unit(direction), at(0.2 * i++), true);
    EXPECT_LT(window.drift(), kBound);
    for (int calm = 0; calm < 50; ++calm) window.add(random.normal3(), at(0.2 * i++), true);
    const int began = i;
    while (window.drift() < kBound && i < began + 100) {
      window.add(random.normal3() + 2 * Vector3d::Unit(direction), at(0.2 * i++), true);
    }
    EXPECT_LT(i - began, 30);
    window.forget();
    EXPECT_EQ(window.drift(), 0);
  }
}

TEST(InnovationWindow, LearnsThatAReceiverSmooths) {
  Random random(3);
  InnovationWindow learnt;
  InnovationWindow unlearnt;
  Vector3d smooth = Vector3d::Zero();
  double largest[2] = {};
  for (int i = 0; i < 5 * 600; ++i) {
    smooth = 0.6 * smooth + 0.8 * random.normal3();  // of variance 1
    learnt.add(smooth, at(0.2 * i), true);
    unlearnt.add(smooth, at(0.2 * i), false);
    if (i < 300) continue;
    largest[0] = std::max(largest[0], learnt.drift());
    largest[1] = std::max(largest[1], unlearnt.drift());
  }
  EXPECT_LT(largest[0], kBound);
  EXPECT_GT(largest[1], kBound);
}

/// Rulings on an antenna at 5 m/s, where the velocities say `measured` and the filter `predicted`.
Dispute::Ruling ruling(const Vector3d& measured, const Vector3d& predicted, double sigma) {
  Random random(4);
  Dispute dispute;
  const Vector3d truth(5, 0, 0);
  for (int i = 0; i < 30; ++i) {
    const double t = 0.2 * i;
    const bool parted = i >= 10;
    dispute.velocity(parted ? measured : truth, parted ? predicted : truth, at(t), parted);
    const auto result = dispute.position(t * truth + sigma * random.normal3(), sigma, at(t + 0.02));
    if (result != Dispute::Ruling::none) return result;
  }
  return Dispute::Ruling::none;
}

TEST(Dispute, ThePositionsSayWhetherFilterOrVelocitiesAreWrong) {
  const Vector3d truth(5, 0, 0);
  for (const Vector3d& error : {Vector3d(2, 0, 0), Vector3d(0, -7, 0), Vector3d(1, 1, 1)}) {
    EXPECT_EQ(ruling(truth + error, truth, 0.25), Dispute::Ruling::velocity_wrong);
    EXPECT_EQ(ruling(truth, truth + error, 0.25), Dispute::Ruling::filter_wrong);
    EXPECT_EQ(ruling(truth + error, truth, 10), Dispute::Ruling::none) << "positions too coarse to tell";
  }
  EXPECT_EQ(ruling(truth, truth, 0.01), Dispute::Ruling::none);
}

/// Seconds after which positions that leave the velocities at `speed` are told; 60 where they are not.
double told(double speed, double noise, std::uint64_t seed) {
  Random random(seed);
  GnssAgreement agreement;
  for (int i = 0; i < 5 * 90; ++i) {
    const double t = 0.2 * i;
    const Vector3d v(3 * std::sin(0.3 * t), 3 * std::cos(0.3 * t), 0);
    const Vector3d p(-10 * std::cos(0.3 * t), 10 * std::sin(0.3 * t), 0);
    agreement.velocity(v + 0.05 * random.normal3(), Vector3d::Ones(), at(t));
    const Vector3d ramp(0, std::max(0.0, t - 30) * speed, 0);
    agreement.position(p + ramp + noise * random.normal3(), Vector3d::Constant(noise),
                       Vector3d::Constant(noise / 2), at(t));
    if (agreement.contradicts()) return t - 30;
  }
  return 60;
}

TEST(GnssAgreement, TellsPositionsThatLeaveTheVelocities) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    EXPECT_EQ(told(0, 0.25, seed), 60) << "they agree";
    EXPECT_GT(told(1, 0.25, seed), 0);
    EXPECT_LT(told(1, 0.25, seed), 6);
    EXPECT_LT(told(5, 0.25, seed), 2.5);
  }
}

/// A receiver that reports course and speed over ground: the climb is no contradiction, what lies along it
/// is.
TEST(GnssAgreement, OfWhatIsNotMeasuredNothingIsSaid) {
  for (const double aside : {0.0, 1.0}) {
    Random random(9);
    GnssAgreement agreement;
    bool contradicts = false;
    for (int i = 0; i < 5 * 90; ++i) {
      const double t = 0.2 * i;
      agreement.velocity(Vector3d(2, 0, 0), Vector3d(1, 1, 0), at(t));
      const Vector3d place(2 * t, aside * std::max(0.0, t - 30), 30 * std::sin(0.2 * t));
      agreement.position(place + 0.25 * random.normal3(), Vector3d::Constant(0.25), Vector3d::Constant(0.13),
                         at(t));
      contradicts = contradicts || agreement.contradicts();
    }
    EXPECT_EQ(contradicts, aside > 0);
  }
  // What says nothing at all does not agree either.
  GnssAgreement silent;
  for (int i = 0; i < 5 * 30; ++i) {
    silent.velocity(Vector3d(7, 7, 7), Vector3d::Zero(), at(0.2 * i));
    silent.position(Vector3d::Zero(), Vector3d::Constant(0.25), Vector3d::Constant(0.13), at(0.2 * i));
    ASSERT_FALSE(silent.contradicts());
    ASSERT_EQ(silent.agreed(at(0.2 * i)), 0);
  }
  // The climb is measured from some moment on: what was before is no evidence.
  GnssAgreement agreement;
  for (int i = 0; i < 5 * 90; ++i) {
    const double t = 0.2 * i;
    const bool measures = t > 40;
    agreement.velocity(Vector3d(0, 0, measures ? 1 : 0), Vector3d(1, 1, measures ? 1 : 0), at(t));
    agreement.position(Vector3d(0, 0, t), Vector3d::Constant(0.25), Vector3d::Constant(0.13), at(t));
    ASSERT_FALSE(agreement.contradicts()) << t;
  }
}

TEST(GnssAgreement, OutliersAreNoDrift) {
  Random random(6);
  GnssAgreement agreement;
  for (int i = 0; i < 5 * 600; ++i) {
    agreement.velocity(0.05 * random.normal3(), Vector3d::Ones(), at(0.2 * i));
    const double noise = random.uniform() < 0.1 ? 20 : 0.25;
    agreement.position(noise * random.normal3(), Vector3d::Constant(0.25), Vector3d::Constant(0.13),
                       at(0.2 * i));
    ASSERT_FALSE(agreement.contradicts()) << i;
  }
}

TEST(GnssAgreement, AJumpIsNoDriftButJumpsInOneDirectionAre) {
  for (const bool back : {true, false}) {
    GnssAgreement agreement;
    bool contradicts = false;
    double offset = 0;
    for (int i = 0; i < 5 * 60; ++i) {
      const double t = 0.2 * i;
      agreement.velocity(Vector3d::Zero(), Vector3d::Ones(), at(t));
      if (i >= 100 && i % 10 == 0) {  // every two seconds
        const double step = back && i % 20 == 0 ? -5 : 5;
        offset += step;
        agreement.jumped({step, 0, 0}, at(t));
      }
      agreement.position({offset, 0, 0}, Vector3d::Constant(0.25), Vector3d::Constant(0.1), at(t));
      contradicts = contradicts || agreement.contradicts();
    }
    EXPECT_EQ(contradicts, !back);
  }
}

TEST(Integrity, IsLostFromAnAlarmUntilNothingHasContradictedForAWhile) {
  Integrity integrity;
  for (int i = 0; i < 200; ++i) {
    const Time now = at(0.2 * i);
    const double t = now.seconds();
    if (i >= 50 && i <= 60) integrity.raise(now);
    integrity.settle(now);
    EXPECT_EQ(integrity.lost, t >= 10 && t < 15 - 1e-9) << t;
  }
  EXPECT_EQ(integrity.times_lost, 1);
}

TEST(Integrity, IsHopelessWhenItStaysLostAndWhatIsUsedContradicts) {
  const auto lost_for = [](double seconds, double innovation) {
    Integrity integrity;
    for (double t = 0; t <= seconds; t += 0.2) {
      integrity.velocity.add({innovation, 0, 0}, at(t), false);
      integrity.position.add({innovation, 0, 0}, at(t), false);
      integrity.raise(at(t));
      integrity.settle(at(t));
    }
    return integrity;
  };
  Integrity integrity = lost_for(20, 4);
  EXPECT_FALSE(integrity.hopeless(at(9)));
  EXPECT_TRUE(integrity.hopeless(at(20)));
  integrity.position_doubted = true;
  EXPECT_FALSE(integrity.hopeless(at(20))) << "the positions are at fault: a new start has no better data";
  EXPECT_FALSE(lost_for(20, 0.5).hopeless(at(20))) << "a magnetometer alone contradicts";
}

}  // namespace
}  // namespace pade::navigation
