// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "config/base/error.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools {

/// The options that hold for every command.
struct CommandOptions {
  bool json = false;
  std::string socket;          ///< empty: the one of the environment, else the default ones
  std::string color = "auto";  ///< auto, always, never
};

/// One call to the daemon.
struct Call {
  std::string method;  ///< with its interface
  Json parameters = Json::object();
  /// It changes something or waits for the disk, which only the control socket offers.
  bool may_change = false;
  std::chrono::milliseconds limit = VarlinkClient::kTimeLimit;
  int descriptor = -1;  ///< of a file to pass along; -1: none
};

/// Connects to the socket that is named, or to the default control socket, or, where that does not open and a
/// command only reads, to the status socket. `may_change`: the command changes something, which only the
/// control socket offers.
ClientResult<VarlinkClient> connectTo(const CommandOptions& options, bool may_change);

/// The reply's parameters.
ClientResult<Json> callOnce(const CommandOptions& options, const Call& call);

/// A document as `--json` shows it.
void printJson(const Json& document);

/// A document in one line, for streams.
void printJsonLine(const Json& document);

/// Prints the names in the list `list` of a document, a line each; as JSON an array.
void showNames(const Json& document, const std::string& list, bool json);

/// Calls once and prints the names in the list `list` of the reply. Returns the exit code.
int printNames(const CommandOptions& options, const Call& call, const std::string& list);

/// Calls once and prints the reply: as JSON, or what `text` makes of it. said: members that the JSON has
/// besides those of the reply, where the text says more than the reply. Returns the exit code.
int callAndPrint(const CommandOptions& options, const Call& call,
                 const std::function<std::string(const Json& reply)>& text,
                 const Json& said = Json::object());

/// Whether waiting may help: the daemon is away or starting, as during a restart, or has no room for another
/// client. Other errors are refusals, which a repeated call would meet again.
bool mayPass(const ClientError& error);

/// The waiting between attempts to reach a daemon again: 0.25 s at first, twice as long each time, 5 s at
/// most, so that a restart is noticed soon and a daemon that stays away costs next to nothing.
class Reconnection {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::milliseconds kFirstWait{250};
  static constexpr std::chrono::milliseconds kMaxWait{5000};

  /// signals: the descriptor of takeSignals(). goesOn: called for each signal that has arrived; false: give
  /// up. deadline: when to give up at the latest.
  Reconnection(int signals, std::function<bool()> goesOn, Clock::time_point deadline)
      : signals_(signals), goesOn_(std::move(goesOn)), deadline_(deadline) {}

  /// Waits, then calls `attempt`, until it succeeds or fails with an error that cannot pass (mayPass).
  /// Returns nothing if it was given up.
  template <typename T>
  std::optional<ClientResult<T>> retry(const std::function<ClientResult<T>()>& attempt) {
    for (auto wait = kFirstWait; waited(wait); wait = std::min(2 * wait, kMaxWait)) {
      ClientResult<T> result = attempt();
      if (result || !mayPass(result.error())) return result;
    }
    return std::nullopt;
  }

 private:
  /// Waits; returns false if it was given up meanwhile.
  bool waited(std::chrono::milliseconds wait) const;

  int signals_;
  std::function<bool()> goesOn_;
  Clock::time_point deadline_;
};

/// Blocks the signals that end the program (SIGINT, SIGTERM, SIGHUP, SIGQUIT), report a new size of the
/// terminal (SIGWINCH) or stop the program for a while (SIGTSTP), and returns a descriptor that becomes
/// readable when one arrives; -1 on failure. From then on a broken pipe is an error of the write.
int takeSignals();

/// Takes the next signal from the descriptor; 0 if there is none.
int nextSignal(int descriptor);

}  // namespace hapticd::tools
