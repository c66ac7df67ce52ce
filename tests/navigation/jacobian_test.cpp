#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pade/core/random.hpp"
#include "pade/navigation/imu_increment.hpp"
#include "pade/navigation/measurement_models.hpp"

#include "navigation/numeric_jacobian.hpp"

namespace pade::navigation {
namespace {

NavigationState random_state(Random& random) {
  NavigationState state;
  state.X.R = rotation_exp(random.normal3());
  state.X.v = random.normal3();
  state.X.p = 5 * random.normal3();
  state.gyroscope_bias = 0.1 * random.normal3();
  state.accelerometer_bias = 0.1 * random.normal3();
  state.position_bias = random.normal3();
  state.height_bias = random.normal();
  state.angular_rate = random.normal3();
  state.iron = 0.05 * random.normal3();
  return state;
}

TEST(ExtendedPose, ExponentialInvertsTheLogarithm) {
  Random random(1);
  for (int i = 0; i < 100; ++i) {
    Vector9d xi;
    xi << random.uniform(0, 3.1) * random.normal3().normalized(), random.normal3(), random.normal3();
    EXPECT_LT((ExtendedPose::exp(xi).log() - xi).norm(), 1e-9);
  }
}

TEST(ExtendedPose, AdjointCarriesAnErrorFromTheRightToTheLeft) {
  Random random(2);
  for (int i = 0; i < 50; ++i) {
    const ExtendedPose X = random_state(random).X;
    Vector9d xi;
    xi << 0.3 * random.normal3(), random.normal3(), random.normal3();
    const ExtendedPose left = ExtendedPose::exp(X.adjoint() * xi) * X;
    const ExtendedPose right = X * ExtendedPose::exp(xi);
    EXPECT_LT((left.inverse() * right).log().norm(), 1e-9);
  }
}

TEST(Rotation, LeftJacobianIsTheDerivativeOfTheExponentialOnBothSidesOfItsSeriesLimit) {
  Random random(3);
  for (const double scale : {1e-4, 0.0099, 0.0101, 0.5, 2.0}) {
    const Vector3d phi = scale * random.normal3().normalized();
    expect_jacobian<3, 3>(left_jacobian(phi), [&](const Vector3d& d) {
      return rotation_log(Quaterniond(rotation_exp(phi + d) * rotation_exp(phi).conjugate()));
    });
  }
}

// Every measurement model against its own numeric derivative, in the error that the filter uses.
struct Model {
  std::string name;
  std::function<Prediction<3>(const NavigationState&)> predict;  // scalars in the first row
};

Prediction<3> padded(const Prediction<1>& scalar) {
  Prediction<3> y;
  y.value = Vector3d(scalar.value[0], 0, 0);
  y.H.setZero();
  y.H.row(0) = scalar.H;
  return y;
}

Prediction<3> padded(const Prediction<2>& pair) {
  Prediction<3> y;
  y.value << pair.value, 0;
  y.H.setZero();
  y.H.topRows<2>() = pair.H;
  return y;
}

class EveryMeasurementModel : public testing::TestWithParam<Model> {};

TEST_P(EveryMeasurementModel, HasTheJacobianOfItsOwnPrediction) {
  Random random(4);
  for (int i = 0; i < 30; ++i) {
    NavigationState state = random_state(random);
    state.X.R = rotation_exp(0.4 * random.normal3());  // upright: azimuth and range exist
    expect_jacobian<3, kBase>(
        GetParam().predict(state).H,
        [&](const BaseVector& error) {
          NavigationState moved = state;
          moved.retract(error);
          return GetParam().predict(moved).value;
        },
        1e-5);
  }
}

const Vector3d kLever(0.3, -0.2, 0.1);
INSTANTIATE_TEST_SUITE_P(
    Models, EveryMeasurementModel,
    testing::Values(
        Model{"GnssPosition", [](const NavigationState& s) { return predict_gnss_position(s, kLever); }},
        Model{"GnssVelocity", [](const NavigationState& s) { return predict_gnss_velocity(s, kLever); }},
        Model{"Velocity", [](const NavigationState& s) { return predict_velocity(s); }},
        Model{"RoadMotion", [](const NavigationState& s) { return padded(predict_road_motion(s)); }},
        Model{"StaticForce", [](const NavigationState& s) { return predict_static_force(s, 9.8); }},
        Model{"BarometricHeight",
              [](const NavigationState& s) { return padded(predict_barometric_height(s)); }},
        Model{"HeadingOfTheBody",
              [](const NavigationState& s) {
                return padded(*predict_azimuth(s, {1, 0, 0}));
              }},
        Model{"AzimuthOfAField",
              [](const NavigationState& s) {
                return padded(*predict_azimuth(s, {0.6, 0.3, -0.2}));
              }},
        Model{"AzimuthOfAMagnetometer",
              [](const NavigationState& s) {
                return padded(*predict_magnetic_azimuth(s, {0.6, 0.4, -0.7}));
              }},
        Model{"RangeToGround", [](const NavigationState& s) { return padded(*predict_range(s, -20)); }}),
    [](const auto& parameter) { return parameter.param.name; });

TEST(ImuStep, InputJacobianIsTheDerivativeOfTheStep) {
  Random random(5);
  for (int i = 0; i < 30; ++i) {
    const Vector3d rate = 2 * random.normal3();
    const Vector3d force = 10 * random.normal3();
    const double dt = 0.01;
    const ImuStep step = imu_step(rate, force, dt);
    const ExtendedPose centre{Quaterniond(step.R), step.v, step.p};
    expect_jacobian<9, 6>(
        step.input_jacobian,
        [&](const Vector6d& d) {
          const ImuStep moved = imu_step(rate + d.head<3>(), force + d.tail<3>(), dt);
          return Vector9d((centre.inverse() * ExtendedPose{Quaterniond(moved.R), moved.v, moved.p}).log());
        },
        1e-6);
  }
}

TEST(ImuStep, MatchesFineIntegrationOfConstantRateAndForce) {
  const Vector3d rate(3, -2, 4);
  const Vector3d force(1, 2, 9);
  const double dt = 0.02;
  Quaterniond R = Quaterniond::Identity();
  Vector3d v = Vector3d::Zero();
  Vector3d p = Vector3d::Zero();
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const double h = dt / n;
    const Vector3d a = (R * rotation_exp(rate * h / 2)) * force;
    p += v * h + 0.5 * a * h * h;
    v += a * h;
    R = R * rotation_exp(rate * h);
  }
  const ImuStep step = imu_step(rate, force, dt);
  const double fourth_order = std::pow(rate.norm() * dt, 3) / 24;  // the first term left out, relative
  EXPECT_LT((step.v - v).norm(), 1.5 * fourth_order * v.norm());
  EXPECT_LT((step.p - p).norm(), 1.5 * fourth_order * p.norm());
}

/// A sequence of steps as the filter takes them; `bias` is taken off every sample.
struct Sequence {
  std::vector<Vector3d> rate;
  std::vector<Vector3d> force;
  double dt = 0.01;

  explicit Sequence(Random& random, int count = 25) {
    for (int i = 0; i < count; ++i) {
      rate.push_back(random.normal3());
      force.push_back(Vector3d(0, 0, 9.8) + 2 * random.normal3());
    }
  }
  [[nodiscard]] ImuIncrement accumulated(const Vector6d& bias, double rate_power = 0,
                                         double force_power = 0) const {
    ImuIncrement increment;
    for (std::size_t i = 0; i < rate.size(); ++i) {
      accumulate(increment, imu_step(rate[i] - bias.head<3>(), force[i] - bias.tail<3>(), dt), dt,
                 Vector3d::Constant(rate_power), Vector3d::Constant(force_power));
    }
    return increment;
  }
};

/// X(T) from X(0): gravity, free motion, increment.
ExtendedPose moved(const ExtendedPose& X, const ImuIncrement& increment) {
  const Vector3d g(0, 0, -9.8);
  const double T = increment.duration;
  return {X.R * Quaterniond(increment.R), X.v + g * T + X.R * increment.v,
          X.p + X.v * T + 0.5 * g * T * T + X.R * increment.p};
}

TEST(ImuIncrement, TransitionCarriesTheErrorOfTheStartExactlyHoweverLarge) {
  // Log-linearity (Barrau and Bonnabel 2017, Theorem 2): no first-order caveat for the group part.
  Random random(6);
  for (int i = 0; i < 20; ++i) {
    const ImuIncrement increment = Sequence(random).accumulated(Vector6d::Zero());
    const ExtendedPose X = random_state(random).X;
    Vector9d xi;
    xi << 0.8 * random.normal3().normalized(), random.normal3(), random.normal3();
    const ExtendedPose end = moved(X, increment);
    const ExtendedPose disturbed = moved(X * ExtendedPose::exp(xi), increment);
    EXPECT_LT(((end.inverse() * disturbed).log() - increment.transition() * xi).norm(), 1e-8);
  }
}

TEST(ImuIncrement, BiasJacobianIsTheDerivativeOfTheIncrement) {
  Random random(7);
  for (int i = 0; i < 10; ++i) {
    const Sequence sequence(random);
    const ImuIncrement increment = sequence.accumulated(Vector6d::Zero());
    const ExtendedPose end = moved(ExtendedPose{}, increment);
    expect_jacobian<9, 6>(
        increment.bias_jacobian,
        [&](const Vector6d& bias) {
          return Vector9d((end.inverse() * moved(ExtendedPose{}, sequence.accumulated(bias))).log());
        },
        1e-6);
  }
}

TEST(ImuIncrement, NoiseHasTheCovarianceOfManyNoisyRuns) {
  Random random(8);
  const Sequence clean(random, 20);
  const double rate_density = 0.01;
  const double force_density = 0.1;
  const ImuIncrement increment =
      clean.accumulated(Vector6d::Zero(), rate_density * rate_density, force_density * force_density);
  const ExtendedPose end = moved(ExtendedPose{}, increment);
  const Eigen::LLT<Matrix9d> factor(increment.noise);
  const int runs = 4000;
  Matrix9d whitened = Matrix9d::Zero();
  for (int run = 0; run < runs; ++run) {
    Sequence noisy = clean;
    for (std::size_t i = 0; i < noisy.rate.size(); ++i) {
      noisy.rate[i] += rate_density / std::sqrt(noisy.dt) * random.normal3();
      noisy.force[i] += force_density / std::sqrt(noisy.dt) * random.normal3();
    }
    const Vector9d xi = (end.inverse() * moved(ExtendedPose{}, noisy.accumulated(Vector6d::Zero()))).log();
    const Vector9d white = factor.matrixL().solve(xi);
    whitened += white * white.transpose() / runs;
  }
  EXPECT_LT((whitened - Matrix9d::Identity()).cwiseAbs().maxCoeff(), 0.12);
}

}  // namespace
}  // namespace pade::navigation
