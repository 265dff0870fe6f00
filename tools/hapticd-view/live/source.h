// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "rt/base/vec3.h"
#include "rt/depth/depth_frame_header.h"
#include "rt/loop/loop_state.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {

/// A raw depth frame. All clients share one, so it does not change once it has been handed out.
struct DepthPicture {
  rt::DepthFrameHeader header = {};   ///< faultOf() has been checked
  std::vector<std::byte> image = {};  ///< header.imageBytes() bytes
};

/// What a viewer wants to change: a fixture to add, or one to remove that was added in this way.
struct FixtureRequest {
  Json add = {};            ///< the members of a definition, as in the configuration; null: remove
  std::string remove = {};  ///< a name
};

/// Receives what a Source has to show. Thread: the io_context's.
class Viewer {
 public:
  virtual ~Viewer() = default;

  /// Each tick that the source delivers, in order.
  virtual void onTick(const rt::Tick&) {}
  /// So many ticks are missing before the next one.
  virtual void onTicksLost(std::uint64_t) {}
  /// The ticks that came together have been delivered.
  virtual void onBatchEnd() {}
  /// The Status object of io.hapticd.Status without `tick`, 5 times a second.
  virtual void onStatus(const Json&) {}
  /// All parameters, name to value, at the start and after each change.
  virtual void onParameters(const Json&) {}
  /// All fixtures and tissue regions, at the start and after each change: `fixtures` and `regions`, lists of
  /// FixtureEntry and RegionEntry of io.hapticd.Status in the order of their sets.
  virtual void onAdditions(const Json&) {}
  /// The shapes of the solids that fixtures have, at the start and after each change: SHA-256 to the reply of
  /// io.hapticd.Status.GetSolid.
  virtual void onSolids(const Json&) {}
  /// An Event object of io.hapticd.Status.
  virtual void onEvent(const Json&) {}
  /// Each depth frame; only the newest where several came together.
  virtual void onDepth(const std::shared_ptr<const DepthPicture>&) {}
  /// Depth frames can be had, or cannot. reason: for people, with the remedy; empty when available.
  virtual void onDepthState(bool /*available*/, const std::string& /*reason*/) {}
  /// The connection to the box came or went. reason: for people, with the remedy; empty when reachable.
  virtual void onBox(bool /*reachable*/, const std::string& /*reason*/) {}

  /// The answer to Source::changeFixture(). problem: a sentence about why nothing was
  /// changed, or why that is not known; empty: it was done.
  virtual void onFixtureAnswer(const std::string& /*name*/, const std::string& /*problem*/) {}
  /// Whether it leads the hand, after Source::moveHand(). problem: why it does not, and what to do; empty: it
  /// does.
  virtual void onHandAnswer(const std::string& /*problem*/) {}

  /// What the source needs to fetch for this viewer. After a change call Source::wantsChanged().
  virtual bool wantsTicks() const = 0;
  virtual bool wantsDepth() const = 0;
};

/// A viewer at the other end of a WebSocket.
class Session : public Viewer {
 public:
  /// A complete text message from the client. Errors: an invalid one is ignored, or MessageSink::close().
  virtual void onText(std::string_view message) = 0;
  /// The longest message that the client may send, bytes; a longer one closes the connection.
  virtual std::size_t longestMessage() const { return 4096; }
};

/// Where pictures come from. Thread: the io_context's.
class Source {
 public:
  virtual ~Source() = default;

  /// The message `hello` of the protocol of `/live`.
  virtual Json hello() const = 0;

  /// Begins to deliver to a viewer, which must be removed before it dies. What is known already comes before
  /// add() returns. Neither may be called from within a viewer's functions, except from onText().
  virtual void add(Viewer& viewer) = 0;
  virtual void remove(Viewer& viewer) = 0;

  /// A viewer's wantsTicks() or wantsDepth() has changed.
  virtual void wantsChanged() = 0;

  /// Changes a fixture for a viewer, which gets the answer while it is added. A source that may not refuses.
  virtual void changeFixture(Viewer& viewer, const FixtureRequest& request);
  /// Leads the hand of a simulated handle to a finite target for a viewer. A source that may not refuses.
  virtual void moveHand(Viewer& viewer, const rt::Vec3& target_m_in_world);
};

/// The name of the fixture that a request is about; empty: it has none.
std::string nameIn(const FixtureRequest& request);

/// The newest events, for those who come later; bounded in number and in bytes.  Thread: one.
class RecentEvents {
 public:
  static constexpr std::size_t kMaxEvents = 64;         ///< as many as the daemon shows to a new client
  static constexpr std::size_t kMaxBytes = 256 * 1024;  ///< as JSON text

  /// An event that is longer than all may be is not kept.
  void add(const Json& event) {
    const std::size_t bytes = event.dump(-1, ' ', false, Json::error_handler_t::replace).size();
    events_.emplace_back(event, bytes);
    bytes_ += bytes;
    while (events_.size() > kMaxEvents || bytes_ > kMaxBytes) {
      bytes_ -= events_.front().second;
      events_.pop_front();
    }
  }
  void clear() { *this = RecentEvents(); }
  std::size_t size() const { return events_.size(); }
  bool contains(const Json& event) const {
    return std::ranges::any_of(events_, [&](const auto& kept) { return kept.first == event; });
  }

  /// Calls `take` with each event, oldest first.
  template <typename Take>
  void forEach(Take take) const {
    for (const auto& [event, bytes] : events_) take(event);
  }

 private:
  std::deque<std::pair<Json, std::size_t>> events_;  // with their size
  std::size_t bytes_ = 0;
};

}  // namespace hapticd::tools::view
