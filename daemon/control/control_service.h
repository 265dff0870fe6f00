#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "daemon/box.h"
#include "daemon/control/varlink_server.h"
#include "daemon/journal_entry.h"

namespace hapticd::daemon {

struct ControlServiceOptions {
  /// How long the force loop may take to take over a change before the caller is told that it has not.
  std::chrono::milliseconds apply_timeout{1000};
  /// Gets an entry for each change, with the uid of who made it. May be empty.
  std::function<void(const JournalEntry&)> log;
};

/// The interfaces io.hapticd.Status, io.hapticd.Control and org.varlink.service, as the .varlink files of
/// this folder describe them. Thread: control thread only.
class ControlService final : public CallHandler {
 public:
  /// `box` outlives the service.
  ControlService(Box& box, ControlServiceOptions options);

  void handle(const Call& call, const Caller& caller, Replies& replies) override;
  void closed(ConnectionId connection) override;

  /// To be called with every tick of the force loop, for the windows of the Monitor streams.
  void onTick(const rt::Tick& tick);
  /// To be called with every entry of the journal, for the streams of events.
  void onEvent(const JournalEntry& entry);
  /// To be called every few milliseconds: answers what has waited for the force loop, and feeds the streams.
  void periodic(Replies& replies);

 private:
  using Clock = std::chrono::steady_clock;
  using Answer = void (ControlService::*)(const Call&, const Caller&, Replies&);

  struct Method {
    std::string_view name;
    Access access;
    bool streams;
    std::vector<std::string_view> parameters;  ///< that it knows
    Answer answer;
  };

  /// What a change is answered with once the force loop has taken it over.
  enum class Awaited { generation, mode, engaged };

  /// A call that waits for that.
  struct Waiting {
    ConnectionId connection;
    std::uint64_t generation;
    Clock::time_point deadline;
    Awaited awaited;
  };

  struct Stream {
    ConnectionId connection;
    Clock::duration interval;
    Clock::time_point due;
    WindowSummary window;
    std::uint64_t dropped;
  };

  static const std::vector<Method>& methods();

  void getInfo(const Call&, const Caller&, Replies&);
  void getInterfaceDescription(const Call&, const Caller&, Replies&);
  void getStatus(const Call&, const Caller&, Replies&);
  void getParameters(const Call&, const Caller&, Replies&);
  void monitor(const Call&, const Caller&, Replies&);
  void setParameters(const Call&, const Caller&, Replies&);
  void engage(const Call&, const Caller&, Replies&);
  void disengage(const Call&, const Caller&, Replies&);

  void answerWhenApplied(const Call& call, const Caller& caller, Replies& replies, std::uint64_t generation,
                         Awaited awaited);
  Reply appliedReply(const Waiting& waiting);
  /// `fields`: of the entry, beside those that say who it was.
  void log(const Caller& caller, const std::string& change, JournalFields fields) const;
  void answerWaiting(Replies& replies);
  void feedStreams(Replies& replies);
  static Reply streamReply(const Stream& stream, const OrderedJson& status);

  Box& box_;
  ControlServiceOptions options_;
  std::vector<Waiting> waiting_;
  std::vector<Stream> streams_;
};

}  // namespace hapticd::daemon
