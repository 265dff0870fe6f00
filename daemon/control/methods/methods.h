// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <expected>
#include <functional>
#include <future>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "daemon/base/box.h"
#include "daemon/control/base/addition_change.h"
#include "daemon/control/base/feed.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/methods/stiffness_feed.h"
#include "daemon/state/profile_folder.h"
#include "daemon/state/start_settings.h"
#include "daemon/state/state_file.h"
#include "rt/fixtures/moving_frame.h"

namespace hapticd::daemon {

/// Methods for what people add to the scene: virtual fixtures and tissue regions.
/// Thread: control thread only.
class AdditionMethods {
 public:
  explicit AdditionMethods(MethodContext& context) : context_(context), feed_(context.box) {}
  std::vector<Method> methods();

  /// To be called every few milliseconds.
  void periodic() { feed_.periodic(StiffnessFeed::Clock::now()); }
  const FeedStatus& feedStatus() const { return feed_.status(); }

 private:
  Answer listFixtures(const Call&, const Caller&);
  Answer listRegions(const Call&, const Caller&);
  Answer changeList(AdditionList list, const Call& call, const Caller& caller);
  Answer setStiffness(const Call&, const Caller&);
  Answer feedStiffness(const Call&, const Caller&);

  /// Applies and logs the change, and answers when the force loop has taken it over.
  Answer apply(AdditionList list, const AdditionChange& change, const Caller& caller);
  std::uint64_t generationOf(AdditionList list) const;

  MethodContext& context_;
  StiffnessFeed feed_;
};

/// Methods for frames that move in the world, whose poses are streamed.
/// Thread: control thread only.
class FrameMethods {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kMaxPerSecond = 500;  ///< poses of one frame

  explicit FrameMethods(MethodContext& context) : context_(context) {}
  std::vector<Method> methods();

  void closed(ConnectionId connection);
  void addWarnings(std::vector<std::string>& list) const;
  /// Poses that were refused because they came too fast, by the name of their frame.
  const std::map<std::string, std::uint64_t, std::less<>>& limited() const { return limited_; }

 private:
  /// What is known of the poses of one frame.
  struct Stream {
    Feed feed;
    rt::MovingFrame judge;  ///< gets what the force loop gets, so that the client is told what that finds
  };

  Answer listFrames(const Call&, const Caller&);
  Answer feedPose(const Call&, const Caller&);

  MethodContext& context_;
  std::map<std::string, Stream, std::less<>> streams_;
  std::map<std::string, std::uint64_t, std::less<>> limited_;
};

/// The method by which another program adds a force to that of the laws.
/// Thread: control thread only.
class ForceMethods {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kMaxPerSecond = 2000;

  explicit ForceMethods(MethodContext& context) : context_(context) {}
  std::vector<Method> methods();

  void closed(ConnectionId connection) { feed_.closed(connection); }
  void addWarnings(std::vector<std::string>& list) const { feed_.addWarnings(Clock::now(), list); }

 private:
  Answer feedForce(const Call&, const Caller&);
  Reply take(const rt::ExternalForce& force, const Caller& caller);

  MethodContext& context_;
  Feed feed_{"forces", kMaxPerSecond};
};

/// The method by which a person leads the hand of a simulated handle.
/// Thread: control thread only.
class HandMethods {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr int kMaxPerSecond = 250;

  explicit HandMethods(MethodContext& context) : context_(context) {}
  std::vector<Method> methods();

  void closed(ConnectionId connection) { feed_.closed(connection); }
  void addWarnings(std::vector<std::string>& list) const { feed_.addWarnings(Clock::now(), list); }

 private:
  Answer moveHand(const Call&, const Caller&);

  MethodContext& context_;
  Feed feed_{"targets of the hand", kMaxPerSecond};
};

/// The camera's pose at the start of the daemon.
struct CalibrationAtStart {
  rt::PoseParameters configured_T_world_camera;
  std::optional<Registration> registration;  ///< the registration in use instead of the configured pose
};

/// Methods for the camera's pose: the one in use, and the one that takes effect at the next start.
/// Thread: control thread only; the file is written by the worker.
class CalibrationMethods {
 public:
  CalibrationMethods(MethodContext& context, StateWorker& worker, const CalibrationAtStart& at_start);
  std::vector<Method> methods();

  /// A warning that a pose waits for the next start, with its remedy.
  std::vector<std::string> warnings() const;

 private:
  Answer getCalibration(const Call&, const Caller&);
  Answer setCalibration(const Call&, const Caller&);
  /// Remembers what was written.
  Reply written(const Caller& caller, const std::optional<Registration>& registration);

  const rt::PoseParameters& poseOf(const std::optional<Registration>& registration) const;
  bool waits() const;

  MethodContext& context_;
  StateWorker& worker_;
  const CalibrationAtStart at_start_;
  std::optional<Registration> registered_;  ///< as it is on the disk
};

/// Methods for parameters, engaging and disengaging.
/// Thread: control thread only.
class ParameterMethods {
 public:
  explicit ParameterMethods(MethodContext& context) : context_(context) {}
  std::vector<Method> methods();

 private:
  Answer getParameters(const Call&, const Caller&);
  Answer setParameters(const Call&, const Caller&);
  Answer engage(const Call&, const Caller&);
  Answer disengage(const Call&, const Caller&);
  Answer clearFault(const Call&, const Caller&);

  /// Disengages, and answers with the mode.
  Answer disengaged();
  /// The mode at the time of the reply. `engaged`: the call requested force, so idle means that it was
  /// refused.
  Reply modeReply(bool engaged);

  MethodContext& context_;
};

/// Methods for profiles, which are named sets of live parameters.
/// Thread: control thread only; files are read and written by the worker.
class ProfileMethods {
 public:
  ProfileMethods(MethodContext& context, StateWorker& worker);
  std::vector<Method> methods();

  using Loaded = std::expected<config::SettingsPart, std::vector<base::Error>>;

 private:
  /// The log entry for a finished job.
  using Done = base::Result<JournalFields>;

  Answer listProfiles(const Call&, const Caller&);
  Answer saveProfile(const Call&, const Caller&);
  Answer loadProfile(const Call&, const Caller&);
  Answer deleteProfile(const Call&, const Caller&);
  Answer setBootProfile(const Call&, const Caller&);

  /// Waits for `job`, then logs `change` with the fields of both and answers with `parameters`.
  Answer answerWhenDone(const Caller& caller, std::function<Done()> job, const std::string& change,
                        const JournalFields& fields, const OrderedJson& parameters = OrderedJson::object());
  /// Sets the parameters of a profile. Returns the Poll that waits for the force loop.
  std::expected<PendingAnswers::Poll, Reply> apply(const Caller& caller, const std::string& name,
                                                   const Loaded& loaded);

  MethodContext& context_;
  StateWorker& worker_;
  ProfileFolder folder_;
};

/// The method that reads the configuration again, and confirms what that has held back.
/// Thread: control thread only.
class ReloadMethods {
 public:
  /// `reloads`: null where there is no configuration that could be read again.
  ReloadMethods(MethodContext& context, Reloads* reloads) : context_(context), reloads_(reloads) {}
  std::vector<Method> methods();

 private:
  Answer reload(const Call&, const Caller&);
  Answer confirm(const Json& number, const Caller&);
  /// Waits for the force loop, then answers with what was done.
  PendingAnswers::Poll answerTo(const Reloads::Outcome& outcome);

  MethodContext& context_;
  Reloads* const reloads_;
};

/// Methods for the shapes of fixtures of kind solid.
/// Thread: control thread only; the lines are computed by the worker.
class SolidMethods {
 public:
  SolidMethods(MethodContext& context, StateWorker& worker) : context_(context), worker_(worker) {}
  std::vector<Method> methods();

 private:
  Answer getSolid(const Call&, const Caller&);
  Answer storeSolid(const Call&, const Caller&);

  MethodContext& context_;
  StateWorker& worker_;
};

/// The method that takes back the last change of live parameters, fixtures and regions.
/// Thread: control thread only.
class UndoMethod {
 public:
  explicit UndoMethod(MethodContext& context) : context_(context) {}
  std::vector<Method> methods();

 private:
  Answer undo(const Call&, const Caller&);

  MethodContext& context_;
};

/// Starting, finishing, listing, keeping, noting, marking and deleting traces.
/// Thread: control thread only.
class TraceMethods {
 public:
  explicit TraceMethods(MethodContext& context) : context_(context) {}
  std::vector<Method> methods();

 private:
  using Done = std::future<base::Result<void>>;
  using Named = std::future<base::Result<std::string>>;

  Answer listTraces(const Call&, const Caller&);
  Answer startTrace(const Call&, const Caller&);
  Answer stopTrace(const Call&, const Caller&);
  Answer dumpTrace(const Call&, const Caller&);
  Answer deleteTrace(const Call&, const Caller&);
  Answer keepTrace(const Call&, const Caller&);
  Answer noteTrace(const Call&, const Caller&);
  Answer markTrace(const Call&, const Caller&);

  /// Logs what was done and answers with the trace's name.
  Answer answerWhenDone(const Caller& caller, Named named, const char* action, const char* change);
  /// Logs what was done and answers without fields; `name`: of the trace.
  Answer answerWhenDone(const Caller& caller, Done done, const std::string& name, const char* action,
                        const char* change);

  MethodContext& context_;
};

}  // namespace hapticd::daemon
