// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "rt/depth_frame.h"
#include "rt/depth_model.h"
#include "rt/vec3.h"
#include "tools/hapticbench/law_setting.h"

namespace hapticd::tools {

/// A method to compute forces from depth frames, to be timed.
class Contender {
 public:
  Contender() = default;
  Contender(const Contender&) = delete;
  Contender& operator=(const Contender&) = delete;
  virtual ~Contender() = default;

  /// Models a frame for a HIP at that position; the frame stays valid until the next one.
  virtual void model(const rt::DepthFrame& frame, const rt::Vec3& hip_m) = 0;
  /// True if the model does not reach far enough to compute a force at that HIP.
  virtual bool needsModel(const rt::Vec3&) const { return false; }
  /// Called when the next HIP is unrelated to the previous one.
  virtual void release() {}
  /// Returns the force in newtons.
  virtual rt::Vec3 force_n(const rt::Vec3& hip_m) = 0;
};

/// A contender by name, created for every run.
struct ContenderKind {
  std::string name;
  std::function<std::unique_ptr<Contender>(const rt::DepthModelParameters& camera)> make;
  bool is_ours = false;
  LawSetting setting;  ///< of ours
  bool is_paper_law = false;
};

ContenderKind ours(const LawSetting& setting);

/// Brute force, and nanoflann's tree of the whole frame and of the points that the HIP can reach: all with
/// the paper's law and its parameters.
std::vector<ContenderKind> libraries();

}  // namespace hapticd::tools
