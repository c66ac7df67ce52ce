#include "pade/simulation/analytic/analytic_scene.hpp"

#include <cmath>
#include <random>

#include <gtest/gtest.h>

#include "pade/simulation/analytic/analytic_flights.hpp"
#include "pade/simulation/analytic/analytic_texture.hpp"

namespace pade::simulation {
namespace {

using Eigen::Vector3d;

Vector3d random_vector(std::mt19937& random, double scale) {
  std::uniform_real_distribution<double> uniform(-scale, scale);
  return {uniform(random), uniform(random), uniform(random)};
}

TEST(AnalyticScene, DepthOfAPlaneIsThatOfTheClosedForm) {
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const Vector3d normal = random_vector(random, 1).normalized();
    const Vector3d point = random_vector(random, 5);
    AnalyticScene scene;
    scene.add("plane", HalfSpace{point, normal});
    const Vector3d origin = point + random_vector(random, 20);
    const Vector3d direction = random_vector(random, 1);
    const double height = normal.dot(origin - point);
    const double descent = -normal.dot(direction);
    const auto hit = scene.cast(origin, direction);
    ASSERT_EQ(hit.has_value(), height > 0 && descent > 0);
    if (hit) {
      EXPECT_NEAR(hit->t / (height / descent), 1, 1e-9);
    }
  }
}

TEST(AnalyticScene, RaysHitABallOnItsNearSide) {
  std::mt19937 random(2);
  int hits = 0;
  for (int i = 0; i < 1000; ++i) {
    const Sphere ball{random_vector(random, 3), 1.5};
    AnalyticScene scene;
    scene.add("ball", ball);
    const Vector3d origin = ball.centre + 20 * random_vector(random, 1).normalized();
    const Vector3d direction = (ball.centre + random_vector(random, 2) - origin) / 7;
    // Closed form by another route: foot of the perpendicular from the centre, then Pythagoras.
    const Vector3d unit = direction.normalized();
    const double foot = unit.dot(ball.centre - origin);
    const double miss = (ball.centre - origin).cross(unit).norm();
    const auto hit = scene.cast(origin, direction);
    ASSERT_EQ(hit.has_value(), miss < ball.radius);
    if (!hit) continue;
    const double t = (foot - std::sqrt(ball.radius * ball.radius - miss * miss)) / direction.norm();
    EXPECT_NEAR(hit->t / t, 1, 1e-9);
    EXPECT_LT(hit->normal.dot(direction), 0);
    ++hits;
  }
  EXPECT_GT(hits, 200);
}

TEST(AnalyticScene, EveryHitLiesOnASurfaceAndTheRayIsFreeBeforeIt) {
  for (const char* name : {"forward", "courtyard"}) {
    const AnalyticScene scene = make_analytic_flight(name, 1)->scene;
    std::mt19937 random(3);
    int hits = 0;
    for (int i = 0; i < 4000; ++i) {
      const Vector3d origin = Vector3d(2, 0, 2) + random_vector(random, 1.9);
      if (scene.inside_solid(origin)) continue;
      const Vector3d direction = random_vector(random, 1);
      const auto hit = scene.cast(origin, direction);
      if (!hit) continue;
      ++hits;
      EXPECT_LT(scene.distance_to_surface(origin + hit->t * direction), 1e-9);
      EXPECT_LT(hit->normal.dot(direction), 0);
      for (double s = 0.05; s < 1; s += 0.05) {
        EXPECT_GT(scene.signed_distance(origin + s * hit->t * direction), 0);
      }
    }
    EXPECT_GT(hits, 1000) << name;
  }
}

TEST(AnalyticScene, SignedDistanceHasUnitGradientOutsideAndVanishesOnTheSurface) {
  const AnalyticScene scene = make_analytic_flight("forward", 1)->scene;
  std::mt19937 random(4);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d point = Vector3d(9, 0, 4) + random_vector(random, 8);
    if (scene.signed_distance(point) < 0.01) continue;
    const double h = 1e-6;
    Vector3d slope;
    for (int axis = 0; axis < 3; ++axis) {
      slope[axis] = (scene.signed_distance(point + h * Vector3d::Unit(axis)) -
                     scene.signed_distance(point - h * Vector3d::Unit(axis))) /
                    (2 * h);
    }
    // Walking down the gradient by the distance ends on the surface.
    const Vector3d foot = point - scene.signed_distance(point) * slope.normalized();
    if (std::abs(slope.norm() - 1) > 1e-6) continue;  // on the ridge between two solids
    EXPECT_LT(scene.distance_to_surface(foot), 1e-5);
  }
}

TEST(AnalyticScene, ASolidThatOverlapsAnotherIsSolidThroughout) {
  AnalyticScene scene;
  scene.add("ground", HalfSpace{});
  scene.add("box", AnalyticBox{{Eigen::Quaterniond::Identity(), {0, 0, 0.5}}, {1, 1, 1}});
  EXPECT_TRUE(scene.inside_solid({0, 0, 0.1}));
  EXPECT_TRUE(scene.inside_solid({0, 0, -0.1}));
  EXPECT_TRUE(scene.inside_solid({5, 0, -0.1}));
  EXPECT_FALSE(scene.inside_solid({5, 0, 0.1}));
  EXPECT_NEAR(scene.distance_to_surface({0, 0, 2.5}), 1.0, 1e-12);
}

TEST(AnalyticTexture, VariesSlowlyComparedWithItsFootprint) {
  // Between neighbouring pixels a band-limited signal changes by less than between distant ones: its
  // correlation over one footprint is near one, and noise finer than the footprint is gone.
  std::mt19937 random(5);
  for (const double footprint : {0.01, 0.05, 0.2}) {
    double step = 0;
    double power = 0;
    for (int i = 0; i < 20000; ++i) {
      const Vector3d p = random_vector(random, 50);
      const Vector3d q = p + footprint * random_vector(random, 1).normalized();
      const double a = band_limited_noise(p, 1.2, 0.005, footprint, 7);
      step += std::pow(band_limited_noise(q, 1.2, 0.005, footprint, 7) - a, 2);
      power += a * a;
    }
    // White noise has a ratio of 2. A sinusoid at half the Nyquist frequency (4 footprints) has 2 (1 - cos
    // 90) = 2 too along its own direction, 0.6 on average over directions.
    EXPECT_LT(step / power, 0.35) << footprint;
    EXPECT_GT(power / 20000, 0.005) << footprint;
  }
}

TEST(AnalyticTexture, FilteredSquareWaveIsTheMeanOfTheSquareWave) {
  std::mt19937 random(6);
  std::uniform_real_distribution<double> uniform(0, 1);
  for (int i = 0; i < 300; ++i) {
    const double x = 20 * uniform(random) - 10;
    const double width = 3 * uniform(random) + 0.01;
    const double period = 2.5;
    const double duty = 0.9;
    double mean = 0;
    constexpr int kSteps = 20000;
    for (int k = 0; k < kSteps; ++k) {
      const double s = x + ((k + 0.5) / kSteps - 0.5) * width;
      const double phase = s - std::floor(s / period) * period;
      mean += std::abs(phase - 0.5 * period) < 0.5 * duty ? 1.0 / kSteps : 0;
    }
    EXPECT_NEAR(filtered_square_wave(x, width, period, duty), mean, 2e-4);
  }
}

}  // namespace
}  // namespace pade::simulation
