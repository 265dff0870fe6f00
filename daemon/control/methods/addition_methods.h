// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "daemon/control/base/addition_change.h"
#include "daemon/control/base/method_context.h"
#include "daemon/control/methods/stiffness_feed.h"
#include "daemon/control/server/call_fields.h"

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
  void listFixtures(const Call&, const Caller&, Replies&);
  void listRegions(const Call&, const Caller&, Replies&);
  void changeList(AdditionList list, const Call& call, const Caller& caller, Replies& replies);
  void setStiffness(const Call&, const Caller&, Replies&);
  void feedStiffness(const Call&, const Caller&, Replies&);

  /// Applies and logs the change, and answers when the force loop has taken it over.
  void apply(AdditionList list, const AdditionChange& change, const Call& call, const Caller& caller,
             Replies& replies);
  std::uint64_t generationOf(AdditionList list) const;

  MethodContext& context_;
  StiffnessFeed feed_;
};

}  // namespace hapticd::daemon
