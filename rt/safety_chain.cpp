#include "rt/safety_chain.h"

#include <algorithm>

namespace hapticd::rt {
namespace {

/// `v`, shortened to `limit` if it is longer.
Vec3 shortened(const Vec3& v, double length, double limit) noexcept {
  return length > limit ? (limit / length) * v : v;
}

}  // namespace

SafetyChain::Output SafetyChain::apply(const Vec3& force_n_in_world, const SafetyParameters& parameters,
                                       double period_s) HAPTICD_RT {
  Output out;
  // Not a stage of its own: a number that is not finite must not reach the stages' memories. The length is
  // looked at too because it can overflow where the components do not.
  const double length = norm(force_n_in_world);
  out.not_finite = !std::isfinite(length);
  const Vec3 aim = out.not_finite ? Vec3{} : force_n_in_world;

  // A lowered limit draws the force inwards first; what that leaves of the step goes towards the aim.
  const double max_step_n = parameters.max_slew_n_per_s * period_s;
  const double last_n = norm(last_);
  const double limit_n = std::max(parameters.max_force_n, last_n - max_step_n);
  const Vec3 from = shortened(last_, last_n, limit_n);
  const double step_left_n = max_step_n - std::max(0.0, last_n - limit_n);

  const Vec3 step = aim - from;
  const double step_length = norm(step);
  out.slew_limited = step_length > step_left_n;
  const Vec3 slewed = from + shortened(step, step_length, step_left_n);

  const double slewed_length = norm(slewed);
  out.magnitude_clamped = slewed_length > limit_n;
  const Vec3 clamped = shortened(slewed, slewed_length, limit_n);

  last_ = isFinite(clamped) ? clamped : Vec3{};
  out.force_n_in_world = last_;
  return out;
}

}  // namespace hapticd::rt
