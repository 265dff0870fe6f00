// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <future>
#include <string>
#include <vector>

#include "daemon/control/base/method_context.h"
#include "daemon/control/server/call_fields.h"

namespace hapticd::daemon {

/// Starting, finishing, listing, keeping, noting, marking and deleting traces.
/// Thread: control thread only.
class TraceMethods {
 public:
  explicit TraceMethods(MethodContext& context) : context_(context) {}
  std::vector<Method> methods();

 private:
  using Done = std::future<base::Result<void>>;
  using Named = std::future<base::Result<std::string>>;

  void listTraces(const Call&, const Caller&, Replies&);
  void startTrace(const Call&, const Caller&, Replies&);
  void stopTrace(const Call&, const Caller&, Replies&);
  void dumpTrace(const Call&, const Caller&, Replies&);
  void deleteTrace(const Call&, const Caller&, Replies&);
  void keepTrace(const Call&, const Caller&, Replies&);
  void noteTrace(const Call&, const Caller&, Replies&);
  void markTrace(const Call&, const Caller&, Replies&);

  /// Refuses the call where too many wait already; true if it did.
  bool refused(const Caller& caller, Replies& replies);
  /// Logs what was done and answers with the trace's name.
  void answerWhenDone(const Call& call, const Caller& caller, Replies& replies, Named named,
                      const char* action, const char* change);
  /// Logs what was done and answers without fields; `name`: of the trace.
  void answerWhenDone(const Call& call, const Caller& caller, Replies& replies, Done done,
                      const std::string& name, const char* action, const char* change);

  MethodContext& context_;
};

}  // namespace hapticd::daemon
