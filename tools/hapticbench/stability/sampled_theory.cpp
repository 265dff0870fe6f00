// SPDX-License-Identifier: Apache-2.0
#include "tools/hapticbench/stability/sampled_theory.h"

#include <Eigen/Eigenvalues>
#include <limits>

namespace hapticd::tools {

double ruleLimit_n_per_m(const DeviceAndHand& system, const SampledSpring& spring) {
  return (system.viscosity_n_s_per_m() + spring.damping_n_s_per_m) /
         (spring.period_s * (0.5 + spring.delay_ticks));
}

double spectralRadius(const DeviceAndHand& system, const SampledSpring& spring) {
  // the state: position, velocity, the previous position, and the delayed forces, the newest first
  const drivers::HeldStep step = drivers::heldStep(system, spring.period_s);
  const int delay = spring.delay_ticks;
  Eigen::MatrixXd loop = Eigen::MatrixXd::Zero(3 + delay, 3 + delay);
  for (int row = 0; row < 2; ++row) {
    loop(row, 0) = step.transition[static_cast<std::size_t>(2 * row)];
    loop(row, 1) = step.transition[static_cast<std::size_t>(2 * row + 1)];
  }
  loop(2, 0) = 1;
  Eigen::RowVectorXd force = Eigen::RowVectorXd::Zero(3 + delay);
  force(0) = -spring.stiffness_n_per_m - spring.damping_n_s_per_m / spring.period_s;
  force(2) = spring.damping_n_s_per_m / spring.period_s;
  Eigen::RowVectorXd applied = force;
  if (delay > 0) {
    loop.row(3) = force;
    for (int age = 1; age < delay; ++age) loop(3 + age, 2 + age) = 1;
    applied.setZero();
    applied(2 + delay) = 1;
  }
  loop.row(0) += step.input[0] * applied;
  loop.row(1) += step.input[1] * applied;
  return Eigen::EigenSolver<Eigen::MatrixXd>(loop, false).eigenvalues().cwiseAbs().maxCoeff();
}

double eigenvalueLimit_n_per_m(const DeviceAndHand& system, SampledSpring spring) {
  const auto stable = [&](double stiffness_n_per_m) {
    spring.stiffness_n_per_m = stiffness_n_per_m;
    return spectralRadius(system, spring) < 1;
  };
  constexpr double kLargest_n_per_m = 1e7;
  double low = 1;
  if (!stable(low)) return 0;
  double high = low * 1.1;
  for (; stable(high); high *= 1.1) {
    if (high > kLargest_n_per_m) return std::numeric_limits<double>::infinity();
    low = high;
  }
  while (high - low > 1e-6 * low) {
    const double middle = (low + high) / 2;
    (stable(middle) ? low : high) = middle;
  }
  return low;
}

}  // namespace hapticd::tools
