// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>

#include "rt/depth_frame.h"
#include "rt/parameters.h"
#include "tools/lib/offline/offline_box.h"

namespace hapticd::tools {

/// A wall that pushes back along one axis: h is the distance in front of the true surface, metres, negative
/// behind it; forces are along the outward normal, newtons. Thread: one.
class Wall {
 public:
  virtual ~Wall() = default;
  /// Stiffness that the wall is set to (k_s) and damping (B).
  virtual void set(double stiffness_n_per_m, double damping_n_s_per_m) = 0;
  /// Sets the delay that the driver of the device reports; initially 0.
  virtual void reportDelay_s(double) {}
  /// Brings the hand from free space to h as a person would, so that what the law remembers is right.
  virtual void approach(double h_m) = 0;
  /// Runs one tick of 1 ms and returns the force.
  virtual double force_n(double h_m, double velocity_m_per_s) = 0;
  /// The h from which on inwards there is a force: 0, or farther out for laws that push before contact.
  virtual double onset_m() const = 0;
  /// Returns the stiffness of the last force, which the core may have reduced.
  virtual double stiffnessKept_n_per_m() const = 0;
};

/// The one-sided spring and damper of the theory, which never pulls.
class ReferenceWall final : public Wall {
 public:
  void set(double stiffness_n_per_m, double damping_n_s_per_m) override {
    stiffness_ = stiffness_n_per_m;
    damping_ = damping_n_s_per_m;
  }
  void approach(double) override {}
  double force_n(double h_m, double velocity_m_per_s) override;
  double onset_m() const override { return 0; }
  double stiffnessKept_n_per_m() const override { return stiffness_; }

 private:
  double stiffness_ = 0;
  double damping_ = 0;
};

/// The force of the core that acts on the device.
enum class CoreOutput {
  law,      ///< the law's alone
  command,  ///< what a device gets: after blend, limits and checks
};

/// A law of the core on a fronto-parallel plane 1 m in front of the camera. Every pixel has the same raw
/// value and the depth model gives that value exactly 1 m, so the plane has neither noise nor steps.
class CoreWall final : public Wall {
 public:
  /// `parameters`: all but the law, the stiffness and the damping; its safety limits are lifted where
  /// `output` is the law's.
  CoreWall(rt::ForceLaw law, const rt::LiveParameters& parameters, CoreOutput output);

  void set(double stiffness_n_per_m, double damping_n_s_per_m) override;
  void reportDelay_s(double delay_s) override { delay_s_ = delay_s; }
  void approach(double h_m) override;
  double force_n(double h_m, double velocity_m_per_s) override;
  double onset_m() const override;
  /// Adds fixtures and tissue regions; null: none. They outlive the wall. The surface is at z = -1 m.
  void setAdditions(const rt::FixtureSet* fixtures, const rt::TissueMap* tissue) {
    box_.setAdditions(fixtures, tissue);
    if (fixtures == nullptr) return;
    for (std::uint32_t i = 0; i < fixtures->count; ++i) {
      double& clearance_m = box_.parameters().standoff_clearance_m;
      const rt::Fixture& fixture = fixtures->fixtures[i];
      if (fixture.kind == rt::FixtureKind::standoff) clearance_m = std::max(clearance_m, fixture.clearance_m);
    }
  }
  double stiffnessKept_n_per_m() const override {
    return stiffness_gain_ * box_.parameters().springs.stiffness_n_per_m;
  }

 private:
  OfflineBox box_;
  CoreOutput output_;
  double delay_s_ = 0;
  double stiffness_gain_ = 1;
  std::unique_ptr<rt::DepthFrame> frame_;
};

}  // namespace hapticd::tools
