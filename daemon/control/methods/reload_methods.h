// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "daemon/base/reloads.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/server/call_fields.h"

namespace hapticd::daemon {

/// The method that reads the configuration again, and confirms what that has held back.
/// Thread: control thread only.
class ReloadMethods {
 public:
  /// `reloads`: null where there is no configuration that could be read again.
  ReloadMethods(MethodContext& context, Reloads* reloads) : context_(context), reloads_(reloads) {}
  std::vector<Method> methods();

 private:
  void reload(const Call&, const Caller&, Replies&);
  void confirm(const Json& number, const Call&, const Caller&, Replies&);
  /// Waits for the force loop, then answers with what was done.
  PendingAnswers::Poll answerTo(const Reloads::Outcome& outcome);

  MethodContext& context_;
  Reloads* const reloads_;
};

}  // namespace hapticd::daemon
