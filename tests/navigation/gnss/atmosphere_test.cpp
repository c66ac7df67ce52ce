#include "pade/navigation/gnss/atmosphere.hpp"

#include <gtest/gtest.h>

namespace pade::gnss {
namespace {

TEST(GeodeticPlace, RoundTripsFromPoleToPole) {
  for (const double latitude : {-1.5707, -1.0, -1e-9, 0.0, 0.5, 0.85, 1.57}) {
    for (const double height : {-400.0, 0.0, 320.0, 30000.0}) {
      const Geodetic there{latitude, 2.1, height};
      const Geodetic back = geodetic_of(ecef_of(there));
      EXPECT_NEAR(back.latitude, there.latitude, 1e-12);
      EXPECT_NEAR(back.longitude, there.longitude, 1e-12);
      EXPECT_NEAR(back.height, there.height, 1e-5);
    }
  }
  // Of the simulator's own papers on spirent_dynamic.
  const Eigen::Vector3d base(4157177.06580187, 671230.476590636, 4774767.03105544);
  EXPECT_LT((ecef_of({48.780735783 * M_PI / 180, 9.17199225 * M_PI / 180, 320}) - base).norm(), 1e-3);
}

TEST(GeodeticPlace, AxesPointEastNorthUp) {
  const Geodetic place{0.85, 0.16, 100};
  const Eigen::Matrix3d axes = enu_axes(place);
  EXPECT_TRUE((axes * axes.transpose()).isIdentity(1e-12));
  Geodetic above = place;
  above.height += 1000;
  EXPECT_LT((axes * (ecef_of(above) - ecef_of(place)) - Eigen::Vector3d(0, 0, 1000)).norm(), 1e-6);
  Geodetic north = place;
  north.latitude += 1e-6;
  EXPECT_NEAR(direction_of(ecef_of(north) - ecef_of(place), axes).azimuth, 0, 1e-5);
}

TEST(Ionosphere, IsFiveNanosecondsAtNightAndLargestAtTwoInTheAfternoon) {
  const IonosphereModel model{{1.5e-8, 2.2e-8, -1.2e-7, -1.2e-7}, {1.1e5, 1.6e5, -6.6e4, -4.6e5}};
  const Geodetic greenwich{0.9, 0, 0};
  const Direction zenith{0, M_PI / 2};
  const auto at = [&](double hour, Direction direction) {
    return ionosphere_delay(model, greenwich, direction, Time{static_cast<std::int64_t>(hour * 3600e9)});
  };
  EXPECT_NEAR(at(2, zenith), 5e-9 * kSpeedOfLight, 0.01);
  EXPECT_GT(at(14, zenith), at(12, zenith));
  EXPECT_GT(at(14, zenith), at(16, zenith));
  EXPECT_GT(at(14, {M_PI, 0.2}), 2 * at(14, zenith));
}

TEST(Troposphere, IsSomeTwoMetresAndAHalfInTheZenith) {
  const Geodetic sea{0.8, 0, 0};
  EXPECT_NEAR(troposphere_delay(sea, {0, M_PI / 2}), 2.45, 0.1);
  EXPECT_NEAR(troposphere_delay(sea, {0, M_PI / 6}), 2 * troposphere_delay(sea, {0, M_PI / 2}), 0.02);
  EXPECT_LT(troposphere_delay({0.8, 0, 3000}, {0, M_PI / 2}), 0.75 * troposphere_delay(sea, {0, M_PI / 2}));
  EXPECT_EQ(troposphere_delay(sea, {0, -0.1}), 0);
}

TEST(Troposphere, FallsWithTheHeightWithoutAStep) {
  const Direction zenith{0, M_PI / 2};
  double last = troposphere_delay({0.8, 0, -1000}, zenith);
  EXPECT_LT(last, 3);
  for (double height = -999; height < 6e4; height += 1) {
    const double delay = troposphere_delay({0.8, 0, height}, zenith);
    ASSERT_LT(delay, last) << height;
    ASSERT_GT(delay, last - 1e-3) << height;
    last = delay;
  }
  EXPECT_NEAR(troposphere_delay({0.8, 0, 11000}, zenith), 0.52, 0.01);    // 226 hPa
  EXPECT_NEAR(troposphere_delay({0.8, 0, 20000}, zenith), 0.126, 0.003);  // 55 hPa
  EXPECT_LT(last, 1e-3);
  for (const double height : {-6e6, -1e4, 4e4, 1e5, 3.6e6, 1e9}) {
    const double delay = troposphere_delay({0.8, 0, height}, zenith);
    EXPECT_GE(delay, 0) << height;
    EXPECT_LT(delay, 3) << height;
  }
}

}  // namespace
}  // namespace pade::gnss
