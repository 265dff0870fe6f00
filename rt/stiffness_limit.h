#pragma once

namespace hapticd::rt {

/// The stiffest spring that a sampled, delayed loop renders stably, N/m:  (b + B) / (T / 2 + t_d)  (Gil et
/// al., Hulin; a linear device of damping b, small B). An eigenvalue sweep over 45 to 100 g, b of 0.05 to 1 N
/// s/m and up to 5 ms finds 0.999 to 1.020 of it for B = 0, and 0.89 to 0.98 for B = 2 N s/m.
/// `damping_n_s_per_m`: b, of the device in the hand, > 0; `wall_damping_n_s_per_m`: B, >= 0; `period_s`: T,
/// > 0; `delay_s`: t_d, >= 0.  RT: safe.
constexpr double largestStableStiffness_n_per_m(double damping_n_s_per_m, double wall_damping_n_s_per_m,
                                                double period_s, double delay_s) noexcept {
  return (damping_n_s_per_m + wall_damping_n_s_per_m) / (period_s / 2 + delay_s);
}

}  // namespace hapticd::rt
