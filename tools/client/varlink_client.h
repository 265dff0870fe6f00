// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <expected>
#include <nlohmann/json.hpp>
#include <string>

namespace hapticd::tools {

/// Keeps the order in which the daemon sent the fields.
using Json = nlohmann::ordered_json;

/// Why there is no result.
struct ClientError {
  enum class Kind {
    no_connection,  ///< nobody there, no permission, or no sense in the answer
    no_answer,      ///< none within the limit; the connection is as it was
    error_reply,    ///< the service answered with an error
    interrupted,    ///< the interrupt descriptor became readable
  };
  Kind kind = Kind::no_connection;
  std::string what;    ///< for people; of an error reply, the error's name
  std::string remedy;  ///< what to do about it; may be empty. Of an error reply: what it means for this call
  Json parameters;     ///< of an error reply
  int system_error = 0;  ///< errno of a connection that could not be made
};

template <typename T>
using ClientResult = std::expected<T, ClientError>;

/// One connection to a Varlink service. Every wait has an end.
/// Thread: one at a time.
class VarlinkClient {
 public:
  static constexpr std::chrono::seconds kTimeLimit{5};

  static ClientResult<VarlinkClient> connect(const std::string& path);

  VarlinkClient(VarlinkClient&& other) noexcept;
  VarlinkClient& operator=(VarlinkClient&&) = delete;
  ~VarlinkClient();

  /// The reply's parameters.
  ClientResult<Json> call(const std::string& method, const Json& parameters = Json::object(),
                          std::chrono::milliseconds limit = kTimeLimit);

  /// Begins a stream of replies; next() takes them. There is no way back but to drop the client.
  ClientResult<void> subscribe(const std::string& method, const Json& parameters);
  /// The next reply's parameters, waited for at most `limit`.
  ClientResult<Json> next(std::chrono::milliseconds limit);
  /// Whether the reply that next() gave last promised another one.
  bool promisesMore() const noexcept { return promises_more_; }
  /// Makes next() give up when `descriptor` becomes readable.
  void interruptBy(int descriptor) noexcept { interrupt_ = descriptor; }

 private:
  VarlinkClient(int socket, std::string path) : socket_(socket), path_(std::move(path)) {}

  ClientResult<void> send(const Json& call);
  bool takeWhatHasCome();
  ClientResult<std::string> receiveMessage(std::chrono::milliseconds limit);
  ClientResult<void> waitForInput(std::chrono::steady_clock::time_point deadline) const;
  ClientError noAnswer() const;
  ClientError broken(std::string what) const;

  int socket_;
  std::string path_;
  std::string input_;
  int interrupt_ = -1;
  bool promises_more_ = false;
};

}  // namespace hapticd::tools
