// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "config/base/error.h"
#include "tools/hapticd-view/box_link/varlink_stream.h"
#include "tools/hapticd-view/live/source.h"

namespace hapticd::tools::view {

/// Asks the box at a control socket whether this process may change it, and changes nothing. `option`: of
/// this program, which needs that, for the error. Blocks for at most VarlinkClient::kTimeLimit.  Thread: any.
/// Errors: it may not, or no box answers there.
base::Result<void> mayControl(const std::string& control_socket, const char* option);

/// Adds fixtures to a box for viewers, through its control socket, with the rights of the user who runs this
/// program. A viewer removes again what it has added itself, unless somebody else has changed or replaced it
/// since. Calls nothing else there, and one call at a time. Thread: the io_context's.
class FixtureChanges {
 public:
  using Clock = std::chrono::steady_clock;
  using Now = std::function<Clock::time_point()>;
  /// `problem`: a sentence about why nothing was changed, or why that is not known, and what to do; empty: it
  /// was done.
  using Answer = std::function<void(const std::string& problem)>;

  /// Requests of all viewers together: a person makes fewer.
  static constexpr std::chrono::milliseconds kPause{500};
  /// So many fixtures may be removed again, as many as a box has room for; of more the oldest may not.
  static constexpr std::size_t kMaxAdded = 16;

  /// `socket`: path of io.hapticd.Control.
  FixtureChanges(boost::asio::io_context& context, std::string socket, Now now = Clock::now)
      : context_(context), socket_(std::move(socket)), now_(std::move(now)) {}
  ~FixtureChanges();
  FixtureChanges(const FixtureChanges&) = delete;
  FixtureChanges& operator=(const FixtureChanges&) = delete;

  /// `viewer`: who asks. Answers at once where the request is refused here, else when the box has answered.
  void request(const Viewer& viewer, const FixtureRequest& request, Answer answer);
  /// The fixtures of the box have changed; as Viewer::onAdditions().
  void follow(const Json& additions);
  /// The box is gone: what it has when it comes back was added by others.
  void forgetAll() { added_.clear(); }
  /// The viewer is gone: nobody removes again what it has added, and its answer is dropped.
  void forget(const Viewer& viewer);

 private:
  struct Added {
    const Viewer* viewer;
    std::string name;
    std::uint64_t made = 0;   // the generation of fixtures in which it was added: FixtureEntry::definedIn
    std::uint64_t known = 0;  // the newest one in which it was still that fixture
  };

  const Added* addedBy(const Viewer& viewer, const std::string& name) const;
  void onDone(const Json& reply);
  void finish(const std::string& problem);

  boost::asio::io_context& context_;
  const std::string socket_;
  const Now now_;
  std::vector<Added> added_;  // the oldest first
  std::shared_ptr<VarlinkStream> call_;
  const Viewer* viewer_ = nullptr;  // who has asked; null: gone meanwhile
  FixtureRequest requested_;
  Answer answer_;
  std::optional<Clock::time_point> last_;
};

}  // namespace hapticd::tools::view
