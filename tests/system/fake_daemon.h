// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

namespace hapticd::test {

/// The reply of a fake daemon to a call.
struct FakeAnswer {
  std::vector<nlohmann::json> replies = {};  ///< parameters; all but the last have "continues"
  std::string error = {};                    ///< not empty: this error follows the replies
  nlohmann::json error_parameters = nlohmann::json::object();
  bool in_turn = false;   ///< each call gets the next reply only, and the last one from then on
  bool endless = false;   ///< the last reply has "continues" too
  bool hangs_up = false;  ///< the connection is closed after the replies
};

/// A Varlink service on a real socket that replies as a test sets it up, and with MethodNotFound to all else.
/// It simulates daemons that are hard to obtain: starting, faulted, of another version.
class FakeDaemon {
 public:
  explicit FakeDaemon(const std::filesystem::path& socket);
  ~FakeDaemon();
  FakeDaemon(const FakeDaemon&) = delete;
  FakeDaemon& operator=(const FakeDaemon&) = delete;

  /// Sets the reply to a method; an empty name stands for all methods without a reply of their own.
  void answer(const std::string& method, FakeAnswer answer);
  /// Sets a single reply.
  void answer(const std::string& method, const nlohmann::json& parameters);
  void refuse(const std::string& method, const std::string& error, const nlohmann::json& parameters);

  /// Returns the calls so far, as received.
  std::vector<nlohmann::json> calls() const;
  /// Parameters of the newest call of a method; null when there was none.
  nlohmann::json newestCall(const std::string& method) const;

 private:
  struct Client {
    int socket;
    std::string input;
  };
  void serve();
  void accept();
  /// Returns false if the connection must be closed.
  bool receive(Client& client);
  bool reply(int socket, const std::string& message);
  FakeAnswer answerTo(const nlohmann::json& call);

  mutable std::mutex mutex_;
  std::map<std::string, FakeAnswer> answers_;
  std::vector<nlohmann::json> calls_;
  std::vector<Client> clients_;
  int listener_ = -1;
  int end_ = -1;
  std::thread thread_;
};

}  // namespace hapticd::test
