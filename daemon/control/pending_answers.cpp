// SPDX-License-Identifier: Apache-2.0
#include "daemon/control/pending_answers.h"

namespace hapticd::daemon {

void PendingAnswers::add(const Call& call, const Caller& caller, Replies& replies, Unawaited unawaited,
                         Poll poll) {
  if (call.oneway && unawaited == Unawaited::forget) return;
  if (auto reply = poll()) return replies.finish(caller.connection, *reply);
  entries_.push_back({call.oneway ? kNoConnection : caller.connection, unawaited, std::move(poll)});
}

void PendingAnswers::answer(Replies& replies) {
  std::erase_if(entries_, [&](Entry& entry) {
    const auto reply = entry.poll();
    if (reply) replies.finish(entry.connection, *reply);
    return reply.has_value();
  });
}

void PendingAnswers::closed(ConnectionId connection) {
  std::erase_if(entries_, [=](Entry& entry) {
    if (entry.connection != connection) return false;
    entry.connection = kNoConnection;
    return entry.unawaited == Unawaited::forget;
  });
}

}  // namespace hapticd::daemon
