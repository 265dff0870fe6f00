// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <chrono>
#include <expected>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <utility>

#include "config/base/descriptor.h"

namespace hapticd::tools {

/// Keeps the order in which the daemon sent the fields.
using Json = nlohmann::ordered_json;

/// Why a call has no result.
struct ClientError {
  enum class Kind {
    no_connection,  ///< no service, no permission, or a reply that is not Varlink
    no_answer,      ///< no reply within the limit; the connection is still usable
    error_reply,    ///< the service replied with an error
    interrupted,    ///< the interrupt descriptor became readable
  };
  Kind kind = Kind::no_connection;
  std::string what;      ///< for people; the name of an error reply
  std::string remedy;    ///< what to do about it; may be empty
  Json parameters;       ///< the parameters of an error reply
  int system_error = 0;  ///< errno of a failed connect()
};

template <typename T>
using ClientResult = std::expected<T, ClientError>;

/// A connection to a Varlink service. Every wait has a time limit.
/// Thread: one at a time.
class VarlinkClient {
 public:
  static constexpr std::chrono::seconds kTimeLimit{5};

  static ClientResult<VarlinkClient> connect(const std::string& path);

  VarlinkClient(VarlinkClient&& other) noexcept;
  VarlinkClient& operator=(VarlinkClient&&) = delete;
  ~VarlinkClient();

  /// Calls a method and returns the parameters of the reply.
  /// `descriptor`: of a file to pass along with the call (SCM_RIGHTS); -1: none.
  ClientResult<Json> call(const std::string& method, const Json& parameters = Json::object(),
                          std::chrono::milliseconds limit = kTimeLimit, int descriptor = -1);

  /// Begins a stream of replies, which next() returns. The connection cannot be used for other calls then.
  ClientResult<void> subscribe(const std::string& method, const Json& parameters);
  /// Waits at most `limit` for the next reply and returns its parameters.
  ClientResult<Json> next(std::chrono::milliseconds limit);
  /// Whether another reply follows the last one that next() returned.
  bool promisesMore() const noexcept { return promises_more_; }
  /// The first descriptor that came with replies since the last call (SCM_RIGHTS); -1: none has come.
  base::Descriptor takeDescriptor() noexcept { return std::move(received_); }
  /// The process that made the socket; 0: not known, as where it is in another container.
  pid_t serviceProcess() const noexcept;
  /// Makes next() return `interrupted` when `descriptor` becomes readable.
  void interruptBy(int descriptor) noexcept { interrupt_ = descriptor; }

 private:
  VarlinkClient(int socket, std::string path) : socket_(socket), path_(std::move(path)) {}

  ClientResult<void> send(const Json& call, int descriptor = -1);
  bool takeWhatHasCome();
  ClientResult<std::string> receiveMessage(std::chrono::milliseconds limit);
  ClientResult<void> waitForInput(std::chrono::steady_clock::time_point deadline) const;
  ClientError noAnswer() const;
  ClientError broken(std::string what) const;

  int socket_;
  std::string path_;
  std::string input_;
  base::Descriptor received_;
  int interrupt_ = -1;
  bool promises_more_ = false;
};

/// Takes what has come at a socket, without waiting, as recv() does, and the first descriptor that came with
/// it (SCM_RIGHTS) unless `descriptor` is one already; further ones are closed.
/// Thread: any.
ssize_t receiveSome(int socket, std::span<char> bytes, base::Descriptor& descriptor);

}  // namespace hapticd::tools
