#include "pade/navigation/imu_increment.hpp"

namespace pade::navigation {
namespace {

/// M <- Ad(Υ_step^-1) F(dt) M, by blocks of three rows (rotation, velocity, position).
template <int Columns>
void transport(const ImuStep& step, double dt, Eigen::Matrix<double, 9, Columns>& M) {
  const Matrix3d Rt = step.R.transpose();
  const Eigen::Matrix<double, 3, Columns> phi = M.template topRows<3>();
  const Eigen::Matrix<double, 3, Columns> nu = M.template middleRows<3>(3);
  const Eigen::Matrix<double, 3, Columns> rho = M.template bottomRows<3>() + dt * nu;
  M.template topRows<3>().noalias() = Rt * phi;
  M.template middleRows<3>(3).noalias() = Rt * (nu - skew(step.v) * phi);
  M.template bottomRows<3>().noalias() = Rt * (rho - skew(step.p) * phi);
}

}  // namespace

Matrix9d ImuIncrement::transition() const {
  const Matrix3d Rt = R.transpose();
  Matrix9d A = Matrix9d::Zero();
  A.block<3, 3>(0, 0) = A.block<3, 3>(3, 3) = A.block<3, 3>(6, 6) = Rt;
  A.block<3, 3>(6, 3) = duration * Rt;
  A.block<3, 3>(3, 0) = -Rt * skew(v);
  A.block<3, 3>(6, 0) = -Rt * skew(p);
  return A;
}

ImuStep imu_step(const Vector3d& rate, const Vector3d& force, double dt) {
  const Vector3d theta = rate * dt;
  const Matrix3d hat = skew(theta);
  const Matrix3d hat2 = hat * hat;
  const Matrix3d I = Matrix3d::Identity();
  // v = ∫ Exp(θ s) a ds dt, p = its integral: series of the left Jacobians applied to a.
  const Matrix3d V = dt * (I + hat / 2 + hat2 / 6);
  const Matrix3d P = dt * dt * (I / 2 + hat / 6 + hat2 / 24);
  const Matrix3d force_hat = skew(force);
  const Matrix3d second = skew(hat * force) + hat * force_hat;  // -d(θ x (θ x a)) / dθ

  ImuStep step;
  step.R = rotation_exp(theta).toRotationMatrix();
  step.v = V * force;
  step.p = P * force;
  const Matrix3d Rt = step.R.transpose();
  step.input_jacobian.block<3, 3>(0, 0) = dt * right_jacobian(theta);
  step.input_jacobian.block<3, 3>(0, 3).setZero();
  step.input_jacobian.block<3, 3>(3, 0) = -dt * dt * Rt * (force_hat / 2 + second / 6);
  step.input_jacobian.block<3, 3>(3, 3) = Rt * V;
  step.input_jacobian.block<3, 3>(6, 0) = -dt * dt * dt * Rt * (force_hat / 6 + second / 24);
  step.input_jacobian.block<3, 3>(6, 3) = Rt * P;
  return step;
}

void accumulate(ImuIncrement& increment, const ImuStep& step, double dt, const Vector3d& rate_power,
                const Vector3d& force_power) {
  increment.p += dt * increment.v + increment.R * step.p;
  increment.v += increment.R * step.v;
  increment.R *= step.R;
  increment.duration += dt;

  transport(step, dt, increment.bias_jacobian);
  increment.bias_jacobian -= step.input_jacobian;

  transport(step, dt, increment.noise);
  Matrix9d transposed = increment.noise.transpose();
  transport(step, dt, transposed);
  Eigen::Matrix<double, 6, 1> variance;  // of the mean rate and force over dt
  variance << rate_power / dt, force_power / dt;
  increment.noise = transposed;
  increment.noise.noalias() += step.input_jacobian * variance.asDiagonal() * step.input_jacobian.transpose();
}

}  // namespace pade::navigation
