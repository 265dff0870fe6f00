// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <expected>
#include <functional>
#include <string>
#include <vector>

#include "daemon/control/base/method_context.h"
#include "daemon/control/server/call_fields.h"
#include "daemon/state/profile_folder.h"
#include "daemon/state/state_worker.h"

namespace hapticd::daemon {

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

  void listProfiles(const Call&, const Caller&, Replies&);
  void saveProfile(const Call&, const Caller&, Replies&);
  void loadProfile(const Call&, const Caller&, Replies&);
  void deleteProfile(const Call&, const Caller&, Replies&);
  void setBootProfile(const Call&, const Caller&, Replies&);

  /// Refuses the call where too many wait already; true if it did.
  bool refused(const Caller& caller, Replies& replies);
  /// Waits for `job`, then logs `change` with the fields of both and answers with `parameters`.
  void answerWhenDone(const Call& call, const Caller& caller, Replies& replies, std::function<Done()> job,
                      const std::string& change, const JournalFields& fields,
                      const OrderedJson& parameters = OrderedJson::object());
  /// Sets the parameters of a profile. Returns the Poll that waits for the force loop.
  std::expected<PendingAnswers::Poll, Reply> apply(const Caller& caller, const std::string& name,
                                                   const Loaded& loaded);

  MethodContext& context_;
  StateWorker& worker_;
  ProfileFolder folder_;
};

}  // namespace hapticd::daemon
