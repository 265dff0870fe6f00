// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "daemon/control/base/method_context.h"
#include "daemon/control/server/call_fields.h"

namespace hapticd::daemon {

/// Methods for parameters, engaging and disengaging.
/// Thread: control thread only.
class ParameterMethods {
 public:
  explicit ParameterMethods(MethodContext& context) : context_(context) {}
  std::vector<Method> methods();

 private:
  void getParameters(const Call&, const Caller&, Replies&);
  void setParameters(const Call&, const Caller&, Replies&);
  void engage(const Call&, const Caller&, Replies&);
  void disengage(const Call&, const Caller&, Replies&);
  void clearFault(const Call&, const Caller&, Replies&);

  void answerWhenApplied(const Call& call, const Caller& caller, Replies& replies, std::uint64_t generation,
                         std::move_only_function<Reply()> reply);
  /// The mode at the time of the reply. `engaged`: the call requested force, so idle means that it was
  /// refused.
  Reply modeReply(bool engaged);

  MethodContext& context_;
};

}  // namespace hapticd::daemon
