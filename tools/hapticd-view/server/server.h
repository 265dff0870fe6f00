// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <list>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "config/base/error.h"
#include "tools/hapticd-view/live/source.h"
#include "tools/hapticd-view/server/access.h"
#include "tools/hapticd-view/server/outbox.h"

namespace hapticd::tools::view {

/// The files of the page, read once at the start: no request reaches the disk, and none can name another
/// file.
class PageFiles {
 public:
  struct File {
    std::string type;  ///< media type
    std::string content;
  };

  /// The files directly in that folder with an ending that a page has.
  /// Errors: no index.html, a file that is unreadable or too long.
  static base::Result<PageFiles> in(const std::filesystem::path& folder);

  /// `path`: of the request, "/" for index.html; null: there is no such file.
  const File* find(const std::string& path) const;

 private:
  std::map<std::string, File> files_;  // by path
};

/// Lines on standard error, which systemd takes into the journal. Refusals are limited, so that nobody fills
/// the disk by being refused. Thread: the io_context's.
class ServerLog {
 public:
  static constexpr int kMaxAtOnce = 20;    ///< refusals in a row
  static constexpr int kMaxPerSecond = 1;  ///< on average after that

  /// A line, whatever came before.
  void write(const std::string& line);
  /// A line about a refusal, unless there were too many; those left out are counted in a later one.
  void refuse(const std::string& who, const std::string& reason);

 private:
  std::chrono::steady_clock::time_point refilled_{};
  double allowed_ = kMaxAtOnce;
  std::uint64_t left_out_ = 0;
};

/// A connection on which no WebSocket is open yet.
struct OpenConnection {
  std::string owner;         ///< who is at the other end (connectionOwner())
  bool is_admitted = false;  ///< its request has been accepted, and is being answered
};

/// How many connections there may be at once.
struct ConnectionLimits {
  std::size_t all = 0;
  std::size_t per_owner = 0;
};

/// What becomes of a new connection.
struct Admission {
  bool is_served = true;
  std::optional<std::size_t> gives_way = {};  ///< the one to be closed before, a place in the list
};

/// Decides about a new connection of `owner` beside those that are open, the oldest first. Where there are
/// too many, the oldest one that has not been admitted gives way: of the same owner if he has his share, else
/// of the owner who has most such connections. So connections that send nothing keep nobody out.
Admission admissionOf(std::span<const OpenConnection> open, const std::string& owner,
                      const ConnectionLimits& limits);

/// A connection before its WebSocket is open, as the rest of the program sees it.
class WaitingConnection {
 public:
  virtual ~WaitingConnection() = default;
  virtual OpenConnection state() const = 0;
  /// Closes it in favour of another one.
  virtual void giveWay() = 0;
};

/// A client with a WebSocket, as the rest of the program sees it.
class ConnectedClient {
 public:
  virtual ~ConnectedClient() = default;
  /// Who is at the other end (connectionOwner()).
  virtual const std::string& owner() const = 0;
  /// Says goodbye, because the program ends.
  virtual void goAway() = 0;
};

/// What all connections share. Outlives them.  Thread: the io_context's.
struct Server {
  static constexpr ConnectionLimits kClientLimits{.all = 10, .per_owner = 8};       ///< WebSockets
  static constexpr ConnectionLimits kConnectionLimits{.all = 64, .per_owner = 48};  ///< the others

  boost::asio::io_context& context;
  Source& source;
  AccessRules rules;  ///< local_address: of no connection
  PageFiles page;
  /// Asks whether the box shows its depth image to everybody, so that no token is needed; the answer comes
  /// later, and is false where the box does not answer.
  std::function<void(std::function<void(bool)>)> ask_open_to_everybody;
  ServerLog log = {};

  std::list<ConnectedClient*> clients = {};        ///< each adds and removes itself
  Outbox::All outboxes = {};                       ///< of the clients
  std::list<WaitingConnection*> connections = {};  ///< likewise; the oldest first
  bool stopping = false;
  std::chrono::steady_clock::time_point last_use = std::chrono::steady_clock::now();
};

}  // namespace hapticd::tools::view
