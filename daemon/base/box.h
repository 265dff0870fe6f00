// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <expected>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/base/descriptor.h"
#include "config/base/error.h"
#include "config/conflicts.h"
#include "config/settings/fixture_settings.h"
#include "config/settings/parameter_table.h"
#include "daemon/base/stored_solid.h"
#include "daemon/status/box_status.h"
#include "daemon/trace/reader/trace_folder.h"
#include "rt/base/vec3.h"
#include "rt/depth/depth_frame.h"
#include "rt/fixtures/fixture.h"
#include "rt/fixtures/moving_frame.h"
#include "rt/loop/loop_state.h"

namespace hapticd::daemon {

/// What a reload or its confirmation has done.
struct ReloadReport {
  std::uint64_t generation = 0;      ///< that the force loop has to take over
  std::vector<std::string> changes;  ///< a sentence each
  std::vector<std::string> waiting;  ///< names of parameters that take effect at the next start
  std::vector<std::string> hidden;   ///< as in Reload
};

/// Reloads of the configuration, as the control API requests them.
/// Thread: control thread only.
class Reloads {
 public:
  using Outcome = std::expected<ReloadReport, std::vector<base::Error>>;

  virtual ~Reloads() = default;
  /// Requests that the configuration file is read again, and returns the number of the reload that does.
  virtual std::uint64_t request() = 0;
  /// The outcome of that reload or a later one; nothing until it has ended.
  virtual std::optional<Outcome> outcome(std::uint64_t number) const = 0;
  /// What waits for confirmation; nothing: nothing does.
  virtual const std::optional<PendingReload>& pending() const = 0;
  /// Applies what waits.  Errors: it contradicts what has changed since.
  virtual Outcome confirm() = 0;
};

/// How a trace is to be recorded.
struct TraceRequest {
  std::string label;  ///< follows the time in the name of the trace; may be empty
  bool depth = false;
};

/// The camera's image and the state of the force loop at one moment.
struct SceneSnapshot {
  std::unique_ptr<rt::DepthFrame> frame;
  rt::DepthModelParameters depth_model;
  rt::PoseParameters T_world_camera;
  rt::Tick tick;  ///< the newest tick
};

/// Memory that holds the newest depth frames (drivers/depth_region).
struct SharedDepth {
  int descriptor = -1;  ///< of the memory file; stays the box's
  std::size_t bytes = 0;
};

/// Counts the changes of the fixtures and of the tissue regions.
struct AdditionGenerations {
  std::uint64_t fixtures = 0;
  /// That of the set in which each fixture became what it is, in their order.
  std::array<std::uint64_t, rt::kMaxFixtures> each_fixture{};
  std::uint64_t regions = 0;  ///< without changes of their stiffness by setMeasuredStiffness()
};

/// What estimators have measured of a region.
struct MeasuredStiffness {
  std::size_t region = 0;  ///< place in Box::additions().regions
  double stiffness_n_per_m = 0;
  double damping_n_s_per_m = 0;
};

/// The running box as the control API uses it.
/// Thread: control thread only.
class Box {
 public:
  virtual ~Box() = default;
  virtual BoxStatus status() = 0;
  /// The current parameters; those that only a restart changes have their values from the start.
  virtual const config::Settings& settings() const = 0;
  /// Hands the changed live parameters, fixtures and regions to the force loop. Returns the generation to
  /// wait for.
  virtual std::uint64_t apply(const config::Settings& settings) = 0;
  /// The fixtures and tissue regions in use.
  virtual const config::SceneAdditions& additions() const = 0;
  virtual AdditionGenerations additionGenerations() const = 0;
  /// Hands checked fixtures and regions to the force loop, which replace all others. Returns the generation
  /// to wait for.
  virtual std::uint64_t applyAdditions(const config::SceneAdditions& additions) = 0;
  /// Whether the store has a solid that a fixture may refer to.
  virtual bool knowsSolid(const std::string& sha256) const = 0;
  /// Stores a solid from a sealed memory file (solid_store.h).  Waits for the disk; takeSolid() makes the
  /// result known.
  virtual std::future<base::Result<StoredSolid>> storeSolid(base::Descriptor memory) = 0;
  virtual base::Result<void> takeSolid(StoredSolid stored) = 0;
  /// A solid by its SHA-256, if it is in memory: that of a fixture, or one that was sent lately; else null.
  virtual std::shared_ptr<const config::Solid> solid(const std::string& sha256) const = 0;
  /// Whether solids of additions() are still being read; their fixtures act as soon as they are.
  virtual bool readsSolids() const = 0;
  /// Why one of these fixtures, of additions(), does not act although it is enabled, and the remedy; empty:
  /// all do.
  virtual std::string solidProblem(const std::vector<config::FixtureSettings>& fixtures) const = 0;
  /// The region of additions() that covers a position, as an index; nothing: none does.
  virtual std::optional<std::size_t> regionAt(const rt::Vec3& position_m_in_world) const = 0;
  /// Gives regions of additions() another stiffness and damping, each within its range. Nobody waits for it.
  virtual void setMeasuredStiffness(const std::vector<MeasuredStiffness>& measured) = 0;
  /// Hands a pose of one of the frames of additions() to the force loop, which checks it; its `number` is set
  /// here. Returns false, and drops it, if the loop has not taken many others yet.
  virtual bool feedPose(const rt::FramePose& pose) = 0;
  /// Hands an external force to the force loop, in place of the one before; see rt::externalForceAt().
  /// Returns false, and drops it, while the box is not engaged and exerts none.
  virtual bool feedForce(const rt::ExternalForce& force) = 0;
  /// Leads the hand of a simulated handle to a target, cut to where the handle may be: a finite one, for a
  /// driver that follows a person (config::HandleDriver::follows_person).
  virtual void moveHand(const rt::Vec3& target_m_in_world) = 0;
  /// Requests `engaged` or `idle`. `inside`: even if the HIP is inside a surface. A request to engage changes
  /// nothing while the box is engaged or holding. Returns the generation to wait for.
  virtual std::uint64_t engage(bool engaged, bool inside) = 0;
  /// Whether a force may act: the box is engaged or holding, or is about to be.
  virtual bool engaged() = 0;
  /// The newest generation that the force loop has taken over.
  virtual std::uint64_t acknowledgedGeneration() = 0;

  // The following functions take as long as the disk or the camera does: each starts its work and returns at
  // once, and the future receives the outcome. Starting, stopping and dumping are done in the order of the
  // calls. Lists and deletions neither wait for these nor for each other.

  /// Starts a trace and returns its name. Errors: one is being written, the folder cannot be written, no
  /// space.
  virtual std::future<base::Result<std::string>> startTrace(const TraceRequest& request) = 0;
  /// Finishes the trace and returns its name. Errors: none is being written.
  virtual std::future<base::Result<std::string>> stopTrace() = 0;
  /// Writes the content of the flight recorder to a trace and returns its name. Errors: it is switched off or
  /// empty, the folder cannot be written, no space.
  virtual std::future<base::Result<std::string>> dumpTrace() = 0;
  virtual std::future<base::Result<std::vector<trace::TraceEntry>>> listTraces() = 0;
  virtual std::future<base::Result<void>> deleteTrace(const std::string& name) = 0;
  /// Marks a trace to be kept, or removes the mark. Errors: no such trace, a failure of the disk.
  virtual std::future<base::Result<void>> keepTrace(const std::string& name, bool keep) = 0;
  /// Writes a line of text about a trace beside it; an empty text removes it.
  virtual std::future<base::Result<void>> noteTrace(const std::string& name, const std::string& text) = 0;
  /// Copies the newest depth frame and its state. Errors: there is none yet.
  virtual std::future<base::Result<SceneSnapshot>> takeSnapshot() = 0;
  /// Writes each depth frame into memory that other processes can map, from now until hideDepth(). Not to be
  /// called again before that. Errors: the system has no memory for it.
  virtual base::Result<SharedDepth> shareDepth() = 0;
  /// Ends that, and closes the memory for its readers.
  virtual void hideDepth() = 0;
};

}  // namespace hapticd::daemon
