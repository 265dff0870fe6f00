// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/steady_timer.hpp>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/depth_region/depth_region.h"
#include "rt/loop/loop_state.h"
#include "tools/hapticd-view/box_link/fixture_changes.h"
#include "tools/hapticd-view/box_link/hand_moves.h"
#include "tools/hapticd-view/box_link/solid_shapes.h"
#include "tools/hapticd-view/box_link/varlink_stream.h"
#include "tools/hapticd-view/live/source.h"
#include "tools/lib/client/varlink_client.h"

namespace hapticd::tools::view {

/// Asks a box for its fixtures and tissue regions whenever a tick was computed with others than those known.
/// Thread: the io_context's.
class AdditionsFetch {
 public:
  /// An estimator may change the regions many times a second.
  static constexpr std::chrono::milliseconds kPause{500};
  /// Receives {"generation": ..., "fixtures": [...], "regions": [...]}: that of the fixtures, and entries of
  /// ListFixtures and ListRegions.
  using OnChange = std::function<void(const Json& additions)>;

  AdditionsFetch(boost::asio::io_context& context, std::string socket, OnChange on_change);
  ~AdditionsFetch() { forget(); }
  AdditionsFetch(const AdditionsFetch&) = delete;
  AdditionsFetch& operator=(const AdditionsFetch&) = delete;

  void onTick(const rt::Tick& tick);
  /// Ends what is under way; nothing is known afterwards.
  void forget();

 private:
  /// One of the two lists.
  struct List {
    const char* method;
    const char* member;
    std::uint64_t current = 0;  ///< generation in the newest tick; 0: none, which needs no call
    std::uint64_t known = 0;    ///< generation of `entries`
    Json entries = Json::array();
    std::shared_ptr<VarlinkStream> call = {};
  };

  void fetchWhatChanged();
  void fetch(List& list);
  void take(List& list, const Json& reply);

  boost::asio::io_context& context_;
  boost::asio::steady_timer pause_;
  bool pausing_ = false;
  std::string socket_;
  OnChange on_change_;
  List fixtures_{"io.hapticd.Status.ListFixtures", "fixtures"};
  List regions_{"io.hapticd.Status.ListRegions", "regions"};
};

/// Waits in a thread of its own for frames in the memory that the daemon shares, and hands each to the thread
/// of the io_context; where that is late only the newest.  Thread of all functions: the io_context's.
class DepthFrames {
 public:
  using Take = std::function<void(std::shared_ptr<const DepthPicture>)>;

  /// Both are called by the io_context, until the object dies. `closed`: no frame follows in this memory.
  DepthFrames(boost::asio::io_context& context, drivers::DepthRegionReader region, Take take,
              std::function<void()> closed);
  /// Waits at most kMaxWait for the thread.
  ~DepthFrames();

 private:
  /// Shared with the thread and with what it has posted.
  struct Shared {
    std::mutex mutex;
    std::shared_ptr<const DepthPicture> newest;  // guarded by mutex; null: taken
    std::atomic<bool> stopped = false;
    Take take;
    std::function<void()> closed;
  };

  static bool readNewest(const drivers::DepthRegionReader& region, const std::shared_ptr<Shared>& shared);
  static void run(boost::asio::io_context& context, const drivers::DepthRegionReader& region,
                  const std::shared_ptr<Shared>& shared);

  std::shared_ptr<Shared> shared_;
  drivers::DepthRegionReader region_;
  std::thread thread_;
};

/// A running box as a source, through the daemon's reading socket. It is connected only while there are
/// viewers, and fetches only what one of them wants.  Thread: the io_context's.
class BoxSource final : public Source {
 public:
  /// `socket`: path of io.hapticd.Status. `version`: of this program, for `hello`. `control_socket`: path of
  /// io.hapticd.Control, by which viewers may add fixtures; empty: they may not, and nothing connects there.
  /// `hand_socket`: likewise, by which they may move the hand of a simulated handle.
  BoxSource(boost::asio::io_context& context, const std::string& socket, std::string version,
            const std::string& control_socket = "", const std::string& hand_socket = "");

  Json hello() const override;
  void add(Viewer& viewer) override;
  void remove(Viewer& viewer) override;
  void wantsChanged() override;
  void changeFixture(Viewer& viewer, const FixtureRequest& request) override;
  void moveHand(Viewer& viewer, const rt::Vec3& target_m_in_world) override;

 private:
  void onStatus(const Json& reply);
  void onTicks(const Json& reply);
  void onEvent(const Json& reply);
  void onDepthShared(const base::Descriptor& memory);
  void setBox(bool reachable, const std::string& reason);
  void setDepth(bool available, const std::string& reason);
  void setAdditions(const Json& additions);
  void fetchParameters();
  void onParameters(const Json& reply);
  void forget();

  boost::asio::io_context& context_;
  std::string socket_;
  std::string version_;
  std::vector<Viewer*> viewers_;

  LastingStream monitor_;
  LastingStream ticks_;
  LastingStream events_;
  LastingStream depth_;
  AdditionsFetch additions_fetch_;
  SolidShapes solid_shapes_;
  std::optional<FixtureChanges> fixture_changes_;
  std::optional<HandMoves> hand_moves_;
  std::shared_ptr<VarlinkStream> parameters_call_;
  bool parameters_changed_ = false;  // since parameters_call_ was sent

  // what a viewer that comes later is shown at once
  std::optional<bool> reachable_;
  std::string reason_;
  std::optional<bool> depth_available_;
  std::string depth_reason_;
  Json status_;
  Json parameters_;
  Json additions_;
  RecentEvents past_events_;
  std::shared_ptr<const DepthPicture> picture_;

  std::uint64_t ticks_lost_ = 0;  // as the stream of ticks counts them
  std::optional<DepthFrames> frames_;
};

}  // namespace hapticd::tools::view
